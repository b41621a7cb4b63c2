# SPDX-License-Identifier: Apache-2.0
"""The bounds on the time step that effects bring, by the numbers that make them."""

import math
from typing import Any

import numpy as np
import pytest
from scenes import MASS, RADIUS, base, belt, bottle, contact, kind, scene, segment

from conveyor_sim.engine.contact.laws.hertz import hertz_contact_time
from conveyor_sim.engine.contact.laws.linear import contact_time
from conveyor_sim.engine.contact.laws.onset import onset_damping
from conveyor_sim.engine.contact.laws.tsuji import tsuji_damping
from conveyor_sim.physics.model import Model, build_model
from conveyor_sim.physics.plant import Plant
from conveyor_sim.physics.timestep.bounds import (
    base_friction_bound,
    contact_friction_bound,
    damping_bound,
    lattice_bound,
    mover_bound,
    slip_time,
    wedge_bound,
)

REDUCED = MASS / 2
INERTIA = MASS * RADIUS**2
RAIL = {"edge": segment((0.0, 6.0), (1.0, 6.0))}


def model_of(*contacts: dict[str, Any], **fields: Any) -> Model:
    """Two bottles, the first at 2 m/s."""
    two = [bottle(0.0, 0.0, 2.0), bottle(1.0, 0.0)]
    return build_model(scene(**{"contacts": list(contacts), "bottles": two, "floor": "none", **fields}))


def bounds(*contacts: dict[str, Any], **fields: Any) -> dict[str, float]:
    """Its bounds (s) by name."""
    return {bound.name: bound.dt for bound in model_of(*contacts, **fields).bounds}


def test_hertz() -> None:
    """At the fastest bottle's speed; the rail, with twice the reduced mass, is longer in touch."""
    k = 1e9
    found = bounds(contact(None, hertz_stiffness=k), contact(None, "steel", hertz_stiffness=k), rails=RAIL)
    deepest = (2.5 * 0.5 * REDUCED * 2.0**2 / k) ** 0.4
    assert found == {
        "impact of two bottles": pytest.approx(hertz_contact_time(k, REDUCED, 2.0) / 20),
        "impact of a bottle and a rail": pytest.approx(hertz_contact_time(k, MASS, 2.0) / 20),
        "Hertz lattice stability": pytest.approx(lattice_bound(1.5 * k * math.sqrt(deepest), MASS)),
        "Hertz rail stability": pytest.approx(wedge_bound(1.5 * k * math.sqrt(deepest * 2.0**0.4), MASS)),
    }


def test_a_light_mover_is_a_body_when_it_is_held_up() -> None:
    """The bound counts the bottles with room on both sides, each against a wall. A mover without limit has none."""
    k, light, length = 1e5, 0.05, 0.4
    gate = {"kind": "slide", "from": [0.0, 3.0], "to": [length, 3.0], "direction": 0.0, "stroke": 0.1, "max_speed": 0.1,
            "acceleration": 1.0, "material": "steel", "moving_mass": light}  # fmt: skip
    found = bounds(contact(1e3), contact(k, "steel"), gates={"g": gate}, rails=RAIL)
    most = 2 * (1 + int(length / (2 * RADIUS)))
    assert found["mover stability"] == pytest.approx(mover_bound(k, MASS, light, most))
    stiffness = np.diag([*[2.0 * k / MASS] * most, most * k / light])
    stiffness[:-1, -1] = stiffness[-1, :-1] = -k / math.sqrt(MASS * light)
    limit = 2.0 / math.sqrt(np.linalg.eigvalsh(stiffness).max())
    assert 0.4 * limit < found["mover stability"] <= 0.5 * limit
    assert "mover stability" not in bounds(
        contact(1e3), contact(k, "steel"), gates={"g": {**gate, "force_limit": "none"}}
    )


def test_hertz_in_a_queue() -> None:
    """A soft packing on a fast belt is pressed deeper by the queue than by a slow impact."""
    k, slow = 1e4, [bottle(0.2 * n, 0.0, 1e-3) for n in range(50)]
    found = bounds(contact(None, hertz_stiffness=k), bottles=slow, floor={"friction": 0.5})
    overlap = (50 * 0.5 * MASS * 9.81 / k) ** (2 / 3)
    assert found["Hertz lattice stability"] == pytest.approx(lattice_bound(1.5 * k * math.sqrt(overlap), MASS))


def test_table_is_bounded_by_its_steepest_slope() -> None:
    found = bounds(contact(None, table=[[0.001, 5.0], [0.002, 25.0], [0.003, 30.0]]))
    assert found == {
        "impact of two bottles": pytest.approx(contact_time(2e4, REDUCED) / 20),
        "table lattice stability": pytest.approx(lattice_bound(2e4, MASS)),
    }


def test_dashpots() -> None:
    assert bounds(contact(5e3, damping=("paper", 3.0)))["paper damping"] == pytest.approx(damping_bound(3.0, REDUCED))
    assert bounds(contact(5e3, damping=("normal", 3.0)))["normal damping"] == pytest.approx(damping_bound(3.0, REDUCED))
    both = bounds(contact(5e3, damping=("paper", 3.0)), contact(5e3, "steel", damping=("normal", 8.0)), rails=RAIL)
    assert both["paper damping"] == pytest.approx(damping_bound(3.0, REDUCED))
    assert both["normal damping"] == pytest.approx(damping_bound(8.0, MASS))


def test_tsuji_dashpot_at_the_deepest_of_an_impact() -> None:
    k, e = 1e9, 0.5
    found = bounds(contact(None, hertz_stiffness=k) | {"damping": {"law": "normal", "restitution": e}})
    deepest = (1.25 * REDUCED * 2.0**2 / k) ** 0.4
    c = tsuji_damping(e, k, REDUCED) * deepest**0.25
    assert found["Tsuji damping"] == pytest.approx(damping_bound(c, REDUCED))


ONSET = {"damping": {"law": "onset", "restitution": 0.5, "speed": 2.0}}
SPEED_AT_A_MILLIMETRE = math.sqrt(2 * 0.5 * 5.0 * 1e-3 / REDUCED)
"""m/s of an impact whose energy the first piece of the table, 5 N at 1 mm, just takes."""


@pytest.mark.parametrize(
    ("elastic", "speed", "force"),
    [
        ({"stiffness": 5e3}, 2.0, 2.0 * math.sqrt(5e3 * REDUCED)),
        ({"hertz_stiffness": 1e9}, 2.0, 1e9 * (1.25 * REDUCED * 4.0 / 1e9) ** 0.6),
        ({"table": [[1e-3, 5.0], [2e-3, 5.0]]}, 0.5 * SPEED_AT_A_MILLIMETRE, 2.5),
        ({"table": [[1e-3, 5.0], [2e-3, 5.0]]}, 2.0 * SPEED_AT_A_MILLIMETRE, 5.0),
        ({"table": [[1e-3, 5.0], [2e-3, 10.0]]}, 3.0 * SPEED_AT_A_MILLIMETRE, 15.0),
    ],
    ids=["linear", "hertz", "first piece", "level piece", "beyond the last point"],
)
def test_onset_dashpot_at_the_largest_force_of_an_impact(elastic: dict[str, Any], speed: float, force: float) -> None:
    two = [bottle(0.0, 0.0, speed), bottle(1.0, 0.0)]
    found = bounds({"between": ["glass", "glass"], **elastic, **ONSET}, bottles=two)
    c = onset_damping(0.5, 2.0) * force
    assert found["onset damping"] == pytest.approx(damping_bound(c, REDUCED))


def test_tangential_spring() -> None:
    """1/m_t is 4/m of two hoops, 2/m of a hoop and a rail: the pair rules. No bound of the friction curve."""
    spring = {"tangential": {"stiffness": 4e3, "damping": 2.0}}
    found = bounds(
        contact(5e3, friction=0.3, **spring),
        contact(5e3, "steel", friction=0.3, **spring),
        rails=RAIL,
        floor={"friction": 0.4},
    )
    assert found["tangential spring"] == pytest.approx(contact_time(4e3, MASS / 4) / 20)
    assert found["tangential damping"] == pytest.approx(damping_bound(2.0, MASS / 4))
    assert "contact friction" not in found
    ratio = {"hertz_stiffness": 1e8, "friction": 0.3, "tangential": {"stiffness_ratio": 0.8}}
    # The deepest overlap of an impact at 2 m/s; a queue of two does not press as hard.
    deepest = (1.25 * REDUCED * 2.0**2 / 1e8) ** 0.4
    mindlin = bounds(contact(None, **ratio), floor={"friction": 0.4})
    assert mindlin["tangential spring"] == pytest.approx(contact_time(1.2e8 * deepest**0.5, MASS / 4) / 20)
    assert "contact friction" not in mindlin
    without = bounds(
        contact(5e3, friction=0.3, **spring), floor={"friction": 0.4}, effects={"tangential_spring": "off"}
    )
    assert "tangential spring" not in without
    assert without["contact friction"] == pytest.approx(
        contact_friction_bound(0.3, 2 * 0.4 * MASS * 9.81, MASS, INERTIA, RADIUS, 0.01)
    )


def test_ring_base() -> None:
    """The bound of sliding is that of a point; that of spinning is J / (m R_b^2) times it."""
    types = {"bottle": kind(base_radius=0.05, inertia=INERTIA / 4)}
    fields: dict[str, Any] = {"bottle_types": types, "floor": {"friction": 0.4}}
    found, point = bounds(contact(5e3), **fields), slip_time(0.4, 9.81, 0.01)
    assert found["base friction"] == pytest.approx(base_friction_bound(0.4, 9.81, 0.01))
    assert found["base slip"] == pytest.approx(point / 20)
    assert found["spin on the base"] == pytest.approx(0.5 * point * (RADIUS / 0.05) ** 2 / 4)
    assert found["base spin"] == pytest.approx(point / 20 * (RADIUS / 0.05) ** 2 / 4)


ELASTIC = {"impact of two bottles", "lattice stability"}


def test_implicit_friction_lifts_the_bounds_of_friction() -> None:
    """Implicit friction removes the bounds of points. Friction of rings stays explicit."""
    fields: dict[str, Any] = {"floor": {"friction": 0.4}, "friction_solver": "implicit"}
    rough = contact(5e3, friction=0.3)
    assert set(bounds(rough, **fields)) == ELASTIC
    assert "contact friction" in bounds(rough, **fields, effects={"implicit_friction": "off"})
    ring = bounds(rough, **fields, bottle_types={"bottle": kind(base_radius=0.05)})
    assert {"base friction", "spin on the base"} < set(ring)


@pytest.mark.parametrize(
    ("integrator", "expected"),
    [
        ("semi_implicit_euler", {"base friction", "base slip", "normal damping", "contact friction", *ELASTIC}),
        ("velocity_verlet", {"base friction", "normal damping", "contact friction", *ELASTIC}),
        ("rk4", {"base friction", "normal damping", "contact friction", *ELASTIC}),
        ("dormand_prince", {"impact of two bottles"}),
        ("linearly_implicit", {"impact of two bottles", "base slip"}),
    ],
)
def test_integrators_are_bounded_by_what_they_can_not_do(integrator: str, expected: set[str]) -> None:
    """Slip under bottles where it is met at a low order; nothing for stability in steps that are, or are divided."""
    rough = contact(5e3, friction=0.3, damping=("normal", 0.1))
    assert set(bounds(rough, floor={"friction": 0.4}, accuracy={"integrator": integrator})) == expected


def test_bounds_of_stability_do_not_depend_on_the_tolerance() -> None:
    rough = contact(5e3, friction=0.3, damping=("normal", 0.1))
    by_preset = {
        preset: model_of(rough, floor={"friction": 0.4}, accuracy=preset).bounds for preset in ("draft", "fine")
    }
    for draft, fine in zip(*by_preset.values(), strict=True):
        assert draft.name == fine.name
        assert (draft.dt == fine.dt) == draft.stability


def test_atan_has_the_bounds_of_the_polynomial() -> None:
    """Both curves have the same slope at rest."""
    fields: dict[str, Any] = {"floor": {"friction": 0.4}}
    rough = contact(5e3, friction=0.3)
    assert bounds(rough, **fields, friction_curve="atan") == bounds(rough, **fields)


ENTERING = {"bottle": "bottle", "position": [3.0, 0.0], "direction": 0.0, "gap": 0.0, "count": 1}


def test_impact_speed_is_the_fastest_at_the_start() -> None:
    fields: dict[str, Any] = {"bottles": [bottle(0.0, 0.0, 0.3, 0.4)], "base": base(0.1), "contacts": [contact(1e3)]}
    assert Plant.of(scene(**fields)).impact_speed == 0.5
    assert Plant.of(scene(**fields, belts={"back": belt(-0.7)})).impact_speed == 0.7
    assert Plant.of(scene(**fields, infeeds={"in": {**ENTERING, "speed": 0.9}})).impact_speed == 0.9
    assert Plant.of(scene(bottles=[bottle(0.0, 0.0)])).impact_speed == 1.0


def test_impact_speed_of_bottles_that_run_against_each_other() -> None:
    two = [bottle(0.0, 0.0, 0.3), bottle(1.0, 0.0, -0.5)]
    assert Plant.of(scene(bottles=two, contacts=[contact(1e3)])).impact_speed == pytest.approx(0.8)
