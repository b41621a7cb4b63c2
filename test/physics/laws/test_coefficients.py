# SPDX-License-Identifier: Apache-2.0
"""The columns of coefficients: which law of the scene goes where, flat by type and by type and rail material."""

import math
from typing import Any

import numpy as np
import pytest
from scenes import MASS, bottle, contact, kind, line, scene, segment

from conveyor_sim.engine.arrays.contacts import ContactLaw
from conveyor_sim.engine.contact.laws.normal import normal_damping
from conveyor_sim.engine.contact.laws.onset import onset_damping
from conveyor_sim.engine.contact.laws.paper import paper_damping
from conveyor_sim.engine.contact.laws.tsuji import tsuji_damping
from conveyor_sim.physics.laws.coefficients import base_radius
from conveyor_sim.physics.model import Model, build_model

TWO = [bottle(0.0, 0.0), bottle(1.0, 0.0)]
RAIL = {"edge": segment((0.0, 6.0), (1.0, 6.0))}


def model_of(*contacts: dict[str, Any], **fields: Any) -> Model:
    return build_model(scene(**{"contacts": list(contacts), "bottles": TWO, "floor": "none", **fields}))


def pair(*contacts: dict[str, Any], **fields: Any) -> ContactLaw:
    law = model_of(*contacts, **fields).pair_law
    assert law is not None
    return law


def given(law: ContactLaw) -> dict[str, list[float]]:
    """The columns that are there."""
    return {name: column.tolist() for name, column in law._asdict().items() if column is not None}


def test_only_what_a_scene_has_is_there() -> None:
    assert given(pair(contact(5e3))) == {"stiffness": [5e3]}
    assert given(pair(contact(None, hertz_stiffness=1e9))) == {"hertz": [1e9]}
    assert given(pair(contact(5e3, damping=("onset", 0.3), friction=0.2))) == {
        "stiffness": [5e3], "damping_onset": [0.3], "friction": [0.2],
    }  # fmt: skip
    springy = contact(5e3, friction=0.2, tangential={"stiffness": 4e3, "damping": 0.5})
    assert given(pair(springy)) == {
        "stiffness": [5e3], "friction": [0.2], "tangential_stiffness": [4e3], "tangential_damping": [0.5],
    }  # fmt: skip
    undamped = contact(5e3, friction=0.2, tangential={"stiffness": 4e3})
    assert "tangential_damping" not in given(pair(undamped))
    mindlin = contact(None, hertz_stiffness=1e9, friction=0.2, tangential={"stiffness_ratio": 0.8})
    assert given(pair(mindlin)) == {
        "hertz": [1e9], "friction": [0.2], "tangential_stiffness": [0.0], "tangential_mindlin": [0.8 * 1.5 * 1e9],
    }  # fmt: skip


def test_columns_are_flat_by_type_and_0_where_a_contact_has_another_law() -> None:
    """A pair of materials counts in either order; entry a * T + b, and type * M + material."""
    model = build_model(scene(**line()))
    assert model.pair_law is not None
    assert model.rail_law is not None
    assert given(model.pair_law) == {
        "stiffness": [5000.0, 3000.0, 3000.0, 2000.0],
        "friction": [0.1, 0.2, 0.2, 0.3],
        "damping_paper": [0.5, 0.0, 0.0, 0.0],
        "damping_normal": [0.0, 0.7, 0.7, 0.0],
    }
    assert given(model.rail_law) == {
        "stiffness": [8000.0, 4000.0],
        "friction": [0.1, 0.15],
        "damping_paper": [0.0, 0.1],
        "damping_normal": [1.0, 0.0],
    }


def test_each_pair_has_one_elastic_law() -> None:
    rows = {"bottle_types": {"a": kind(), "b": kind(material="pet")}, "rails": RAIL}
    model = model_of(
        contact(5e3),
        contact(None, "pet", hertz_stiffness=1e9),
        {"between": ["pet", "pet"], "table": [[0.001, 5.0], [0.002, 20.0]]},
        {"between": ["pet", "steel"], "table": [[0.0, 0.0], [0.001, 3.0]]},
        contact(7e3, "steel"),
        **rows,
        bottles=[bottle(0.0, 0.0, type="a"), bottle(1.0, 0.0, type="b")],
    )
    assert model.pair_law is not None
    assert model.rail_law is not None
    assert given(model.pair_law) == {
        "stiffness": [5e3, 0.0, 0.0, 0.0],
        "hertz": [0.0, 1e9, 1e9, 0.0],
        "curve": [-1, -1, -1, 0],
    }
    assert given(model.rail_law) == {"stiffness": [7e3, 0.0], "curve": [-1, 1]}
    assert model.pair_law.curve is not None
    assert model.pair_law.curve.dtype == np.int32
    curves = model.curves
    assert curves is not None
    # A table that starts above 0 gets (0, 0).
    assert curves.start.tolist() == [0, 3, 5]
    assert curves.overlap.tolist() == [0.0, 0.001, 0.002, 0.0, 0.001]
    assert curves.force.tolist() == [0.0, 5.0, 20.0, 0.0, 3.0]
    assert model_of(contact(5e3)).curves is None


REDUCED = MASS / 2


@pytest.mark.parametrize(
    ("fields", "column", "expected"),
    [
        ({"stiffness": 5e3, "damping": {"law": "paper", "restitution": 0.8}}, "damping_paper",
         paper_damping(0.8, 5e3, REDUCED)),
        ({"stiffness": 5e3, "damping": {"law": "normal", "restitution": 0.8}}, "damping_normal",
         normal_damping(0.8, 5e3, REDUCED)),
        ({"hertz_stiffness": 1e9, "damping": {"law": "normal", "restitution": 0.8}}, "damping_tsuji",
         tsuji_damping(0.8, 1e9, REDUCED)),
        ({"hertz_stiffness": 1e9, "damping": {"law": "normal", "coefficient": 0.8}}, "damping_normal", 0.8),
        ({"stiffness": 5e3, "damping": {"law": "onset", "restitution": 0.8, "speed": 0.5}}, "damping_onset",
         onset_damping(0.8, 0.5)),
        ({"table": [[1e-3, 9.0]], "damping": {"law": "onset", "restitution": 0.8, "speed": 0.5}}, "damping_onset",
         onset_damping(0.8, 0.5)),
        ({"table": [[1e-3, 9.0]], "damping": {"law": "normal", "coefficient": 0.8}}, "damping_normal", 0.8),
    ],
)  # fmt: skip
def test_coefficients_of_damping(fields: dict[str, Any], column: str, expected: float) -> None:
    law = pair({"between": ["glass", "glass"], **fields})
    assert getattr(law, column).tolist() == pytest.approx([expected], rel=1e-14)
    dampings = [name for name in given(law) if name.startswith("damping")]
    assert dampings == [column]


def test_restitution_is_solved_for_each_pair_of_masses() -> None:
    """c goes with the root of the reduced mass: m_r of two bottles, the bottle's own at a rail."""
    half = {"law": "normal", "restitution": 0.5}
    model = model_of(
        contact(5e3, damping=None) | {"damping": half},
        contact(5e3, "steel") | {"damping": half},
        bottle_types={"light": kind(mass=0.1), "heavy": kind(mass=0.3)},
        rails=RAIL,
        bottles=[bottle(0.0, 0.0, type="light"), bottle(1.0, 0.0, type="heavy")],
    )
    c = normal_damping(0.5, 5e3, 1.0)
    assert model.pair_law is not None
    assert model.rail_law is not None
    np.testing.assert_allclose(
        model.pair_law.damping_normal, [c * math.sqrt(m) for m in (0.05, 0.075, 0.075, 0.15)], rtol=1e-12
    )
    np.testing.assert_allclose(model.rail_law.damping_normal, [c * math.sqrt(m) for m in (0.1, 0.3)], rtol=1e-12)


def test_restitution_of_one_is_no_damping() -> None:
    law = pair(contact(5e3) | {"damping": {"law": "normal", "restitution": 1}})
    assert given(law) == {"stiffness": [5e3]}


def test_effects_that_are_off_have_no_columns() -> None:
    springy = contact(5e3, damping=("paper", 0.1), friction=0.2, tangential={"stiffness": 4e3})
    steel = contact(5e3, "steel")
    everything = pair(springy)
    assert set(given(everything)) == {"stiffness", "damping_paper", "friction", "tangential_stiffness"}
    assert set(given(pair(springy, effects={"paper_damping": "off"}))) == set(given(everything)) - {"damping_paper"}
    assert set(given(pair(springy, effects={"contact_friction": "off"}))) == {"stiffness", "damping_paper"}
    assert set(given(pair(springy, effects={"tangential_spring": "off"}))) == set(given(everything)) - {
        "tangential_stiffness"
    }
    model = model_of(springy, steel, rails=RAIL, effects={"bottle_contact": "off"})
    assert model.pair_law is None
    assert model.rail_law is not None
    model = model_of(springy, steel, rails=RAIL, effects={"segment_rails": "off"})
    assert (model.rail_law, model.segments) == (None, None)


def test_base_radius_by_type() -> None:
    types = {"ring": kind(base_radius=0.04), "point": kind()}
    assert base_radius(scene(bottle_types=types)).tolist() == [0.04, 0.0]
    floor = {"friction": 0.3}
    assert build_model(scene(bottle_types=types, floor="none")).type_base_radius is None
    assert build_model(scene(floor=floor)).type_base_radius is None
    radius = build_model(scene(bottle_types=types, floor=floor)).type_base_radius
    assert radius is not None
    assert radius.tolist() == [0.04, 0.0]
    assert build_model(scene(bottle_types=types, floor=floor, effects={"ring_base": "off"})).type_base_radius is None
