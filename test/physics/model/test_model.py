# SPDX-License-Identifier: Apache-2.0
"""Scene to model: tables, bounds and the time step that follows, with its reason."""

import math
from typing import Any

import numpy as np
import pytest
from scenes import MASS, RADIUS, arc, base, belt, bottle, contact, kind, line, polyline, scene, segment

from conveyor_sim.engine.compiler.compile import ENGINE_HASH
from conveyor_sim.errors import SceneError
from conveyor_sim.physics.laws.coefficients import base_friction
from conveyor_sim.physics.model import build_model
from conveyor_sim.simulation import Simulation

TWO = [bottle(0.0, 0.0), bottle(1.0, 0.0)]


def bounds(**fields: Any) -> dict[str, float]:
    return {bound.name: bound.dt for bound in build_model(scene(**fields)).bounds}


def impact_bound(mass: float, stiffness: float, friction: float, speed: float) -> float:
    """1 % in the peak of a linear impact: of 0.6 (w dt)^2 / 8, and of mu g dt / (2 v) at a fifth of the speed."""
    a, b = (0.6 / 8.0 * stiffness / mass) ** 2, (friction * 9.81 / (2.0 * 0.2 * speed)) ** 2
    squared = (math.sqrt(b * b + 4.0 * a * 0.01**2) - b) / (2.0 * a)
    return min(math.sqrt(squared), math.pi * math.sqrt(mass / stiffness) / 20)


def test_bounds_of_the_papers_test_case() -> None:
    """k = 5 / 10 kN/m, c = 0.1 kg/s, mu 0.4 / 0.1, v_lim = 10 mm/s, a hundred bottles on 10 m of belt."""
    found = bounds(
        contacts=[contact(5e3, damping=("paper", 0.1), friction=0.1), contact(10e3, "steel", ("paper", 0.1), 0.1)],
        base=base(0.4),
        belts={"table": belt(0.2)},
        rails={"edge": segment((0.0, 6.0), (1.0, 6.0))},
        bottles=[{"grid": {"type": "bottle", "origin": [0.0, 0.0], "rows": 10, "columns": 10, "pitch": 0.14}}],
    )
    # The rail's contact is as long as the pair's: twice the stiffness, twice the reduced mass. The dashpot adds 1e-4.
    assert found == {
        "impact of two bottles": pytest.approx(impact_bound(0.1, 5e3, 0.4, 0.2), rel=1e-3),
        "impact of a bottle and a rail": pytest.approx(impact_bound(0.2, 10e3, 0.4, 0.2), rel=1e-3),
        "lattice stability": pytest.approx(1.0 / math.sqrt(6.0 * 5e3 / MASS)),
        "rail stability": pytest.approx(1.0 / math.sqrt(2.0 * 10e3 / MASS)),
        "paper damping": pytest.approx(0.5 * (MASS / 2) / 0.1),
        "base friction": pytest.approx(0.5 * 0.01 / (0.4 * 9.81)),
        "base slip": pytest.approx(0.01 / (0.4 * 9.81) / 20),
        "contact friction": pytest.approx(MASS * 0.01 / (4 * 0.1 * (1 + 3.5 * 10.0 / 0.13) * 0.4 * MASS * 9.81)),
    }


def test_bounds_take_the_tightest_of_types_and_materials() -> None:
    """The lighter bottle, the stiffer contact, the higher friction."""
    types = {"heavy": kind(), "light": kind(0.03, 0.02, inertia=1e-5)}
    fields: dict[str, Any] = {
        "bottle_types": types,
        "contacts": [contact(4e3, friction=0.1), contact(90e3, "steel", friction=0.3)],
        "base": base(0.4),
        "belts": {"table": belt(0.2)},
        "floor": {"friction": 0.7},
        "bottles": [bottle(0.0, 0.0, type="heavy"), bottle(1.0, 0.0, type="light")],
    }
    without = bounds(**fields)
    assert without["impact of two bottles"] == pytest.approx(impact_bound(0.01, 4e3, 0.7, 0.2))
    assert without["lattice stability"] == pytest.approx(1.0 / math.sqrt(6.0 * 4e3 / 0.02))
    assert without["base slip"] == pytest.approx(0.01 / (0.7 * 9.81) / 20)
    railed = bounds(**fields, rails={"edge": segment((0.0, 6.0), (1.0, 6.0))})
    assert railed["impact of a bottle and a rail"] == pytest.approx(impact_bound(0.02, 90e3, 0.7, 0.2))
    # At most three times mu m g of all, if wedged; the light one turns more easily, 1/m + R^2/J = 50 + 90.
    force = 3 * 0.7 * (MASS + 0.02) * 9.81
    assert railed["contact friction"] == pytest.approx(0.01 / (2 * 0.3 * (50 + 90) * force))


def test_what_is_absent_does_not_bound() -> None:
    assert bounds(bottles=TWO[:1], floor="none") == {}
    elastic = {"impact of two bottles", "lattice stability"}
    assert set(bounds(bottles=TWO, contacts=[contact(1e3)], floor="none")) == elastic
    frictionless = bounds(bottles=TWO, contacts=[contact(1e3, friction=0.2)], floor="none")
    assert set(frictionless) == elastic
    assert set(bounds(bottles=TWO[:1], floor={"friction": 0.3})) == {"base friction", "base slip"}


def test_chosen_steps_keep_every_bound() -> None:
    model = build_model(scene(**{**line(), "accuracy": {}}))
    assert model.dt * model.steps_per_tick == pytest.approx(0.01)
    tightest = min(bound.dt for bound in model.bounds)
    assert model.dt <= tightest < 0.01 / (model.steps_per_tick - 1)
    ruled = f"{model.steps_per_tick} steps a tick: standard (1 % in contact force), ruled by "
    assert model.dt_reason.startswith(ruled)
    assert min(model.bounds, key=lambda bound: bound.dt).reason in model.dt_reason


def test_given_steps_are_told() -> None:
    model = build_model(scene(accuracy={"per_tick": 3}, **{k: v for k, v in line().items() if k != "accuracy"}))
    assert model.steps_per_tick == 3
    assert model.dt == pytest.approx(0.01 / 3)
    assert "given in the scene" in model.dt_reason
    assert "beyond the bound of stability by contact friction" in model.dt_reason
    assert model.accuracy == "given, 3 steps a tick"


def test_more_steps_than_ever_end_are_refused() -> None:
    stiff = scene(contacts=[contact(1e19)], bottles=[bottle(0.0, 0.0), bottle(1.0, 0.0)])
    with pytest.raises(
        SceneError, match=r"^<text>:1: accuracy: \d+ steps a tick.*; expected at most 1000000 steps a tick$"
    ):
        build_model(stiff)


def test_a_longest_step_is_kept_with_the_fewest_steps() -> None:
    model = build_model(scene(**line(accuracy={"dt": 0.0003})))
    assert model.steps_per_tick == 34
    assert model.accuracy == "given, at most 300 us"


def test_types_and_names_are_in_the_scenes_order() -> None:
    model = build_model(scene(**line()))
    assert model.bottle_types == ("bottle", "small")
    np.testing.assert_array_equal(model.type_radius, [RADIUS, 0.03])
    np.testing.assert_allclose(model.type_inertia, [MASS * RADIUS**2, 3e-5])
    assert model.belts == ("feeder", "bend", "end", "side")
    assert model.rails == ("right", "left", "outer", "inner", "fence", "bend_inner", "bend_outer")
    assert (model.name, model.tick_ns, model.integrator) == ("test", 10_000_000, "leapfrog")
    assert model.engine_hash == ENGINE_HASH
    assert [entry.split("=")[0] for entry in model.versions] == ["conveyor_sim", "numba", "llvmlite", "numpy"]
    assert model.machine
    assert model.has("rotation")
    assert not build_model(scene(bottles=TWO[:1])).has("rotation")


def test_base_friction_by_belt_and_bottle_type() -> None:
    """Bottle's material first, then the belt's: a material may be used for both."""
    given = scene(
        bottle_types={"one": kind(material="a"), "other": kind(material="b")},
        belts={"first": belt(0.0, (0.0, 0.0), 1.0, 1.0, material="a"),
               "second": belt(0.0, (2.0, 0.0), 1.0, 1.0, material="b")},
        base=[{"between": [bottle_, belt_], "friction": mu}
              for bottle_, belt_, mu in (("a", "a", 0.1), ("a", "b", 0.2), ("b", "a", 0.3), ("b", "b", 0.4))],
    )  # fmt: skip
    # The floor, last, is as the first belt.
    np.testing.assert_array_equal(base_friction(given), [[0.1, 0.3], [0.2, 0.4], [0.1, 0.3]])


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"floor": {"friction": 0.25}}, [0.25]),
        ({"floor": "none"}, [0.0]),
        ({}, [0.0]),
        ({"belts": {"one": belt(0.0)}, "base": base(0.4)}, [0.4]),
        ({"belts": {"one": belt(0.0)}, "base": base(0.4), "floor": {"friction": 0.0}}, [0.0]),
        ({"belts": {"one": belt(0.0)}, "base": base(0.4), "floor": "none"}, [0.0]),
    ],
)
def test_friction_of_the_floor(fields: dict[str, Any], expected: list[float]) -> None:
    np.testing.assert_array_equal(base_friction(scene(**fields))[-1], expected)


def test_rails_that_meet_are_one_surface() -> None:
    """End to end however listed, more than two at a point, or an end on another's side; apart or crossing are not."""
    rails = {
        "chain": polyline([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)]),
        "goes_on": segment((2.0, 1.0), (1.0, 1.0)),
        "third_arm": segment((1.0, 1.0), (0.5, 2.0)),
        "bends": arc((2.0, 1.5), 0.5, -math.pi / 2, 1.0),
        "stem": segment((1.5, 1.0), (1.5, 0.2)),
        "apart": segment((5.0, 0.0), (6.0, 0.0)),
        "almost": segment((6.0 + 2e-6, 0.0), (7.0, 0.0)),
        "crossing": segment((5.5, -1.0), (5.5, 1.0)),
    }
    model = build_model(scene(rails=rails, contacts=[contact(1e3, "steel")], bottles=[bottle(9.0, 9.0)]))
    assert model.segments is not None
    assert model.arcs is not None
    by_rail: dict[str, set[int]] = {}
    for pieces in (model.segments, model.arcs):
        for rail, surface in zip(pieces.rail.tolist(), pieces.surface.tolist(), strict=True):
            by_rail.setdefault(model.rails[rail], set()).add(surface)
    joined = [by_rail[name] for name in ("chain", "goes_on", "third_arm", "bends", "stem")]
    assert all(surfaces == joined[0] and len(surfaces) == 1 for surfaces in joined)
    alone = [by_rail[name].pop() for name in ("apart", "almost", "crossing")]
    assert len({*joined[0], *alone}) == 4


def test_a_large_plant_gets_a_grid_of_bounded_size() -> None:
    """Far apart as things may be, the static grid keeps to its largest number of cells."""
    rails = {"here": segment((0.0, 0.0), (0.1, 0.0)), "there": segment((9e4, 9e4), (9e4, 9.1e4))}
    model = build_model(scene(rails=rails, contacts=[contact(1e3, "steel")], bottles=[bottle(1.0, 1.0)]))
    assert model.grid is not None
    assert model.grid.columns * model.grid.rows < 300_000


@pytest.mark.parametrize("law", ["paper", "normal"])
@pytest.mark.parametrize("c", [50.0, 500.0, 2000.0])
def test_a_strong_dashpot_shortens_the_step_until_it_holds(law: str, c: float) -> None:
    """Two bottles at 1 m/s against each other: however strong the dashpot, they never leave faster than they came."""
    pair = [bottle(0.0, 0.0, velocity=[0.5, 0.0]), bottle(0.14, 0.0, velocity=[-0.5, 0.0])]
    sim = Simulation(scene(accuracy={}, floor="none", contacts=[contact(5e3, damping=(law, c))], bottles=pair))
    sim.advance(20)
    assert abs(np.diff(sim.bottles().vx)[0]) <= 1.0
