# SPDX-License-Identifier: Apache-2.0
"""Surfaces of belts and plates: bends in both senses of travel, path belts with ratios, plates at rest."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import NO_OUTPUTS, base, belt, bottle, contact, kind, scene, segment, simulation

from conveyor_sim.simulation import Simulation

MU, G, V = 0.4, 9.81, 0.3
CENTRE = (0.2, -0.1)
INNER, WIDTH = 0.45, 0.1
RADIUS = INNER + WIDTH / 2
"""m, of the centre line of the bends."""
START = "-90 deg"
BASE = [*base(MU), {"between": ["glass", "nylon"], "friction": 0.25}]
LEDGER = {"outputs": {**NO_OUTPUTS, "ledger": 100}}


def bend(turn: str, **more: Any) -> dict[str, Any]:
    """A quarter ring from below its centre to the right of it."""
    return {"kind": "curved", "centre": CENTRE, "inner_radius": INNER, "width": WIDTH, "start_angle": START,
            "span": "90 deg", "turn": turn, **more}  # fmt: skip


def from_to(turn: str, side: str, **more: Any) -> dict[str, Any]:
    """The area of `bend` by the ends of its inner arc."""
    below, right = (CENTRE[0], CENTRE[1] - INNER), (CENTRE[0] + INNER, CENTRE[1])
    ends = {"from": below, "to": right} if side == "left" else {"from": right, "to": below}
    return {"kind": "curved", "inner_radius": INNER, "width": WIDTH, "side": side, "turn": turn, **ends, **more}


def on_bend(belt: dict[str, Any], angle: float, **more: Any) -> Simulation:
    """A line of one belt with a bottle at rest in the middle of `bend`, at an angle (rad) seen from its centre."""
    place = CENTRE[0] + RADIUS * math.cos(angle), CENTRE[1] + RADIUS * math.sin(angle)
    fields = {"base": BASE, "gravity": G, "bottles": [bottle(*place)], **more}
    return simulation(belts={"bend": {"material": "chain", **belt}}, **fields)


def seen(sim: Simulation) -> tuple[float, float]:
    """Angle (rad) and distance (m) of the bottle, from the centre of the bend."""
    state = sim.bottles()
    x, y = state.x[0] - CENTRE[0], state.y[0] - CENTRE[1]
    return math.atan2(y, x), math.hypot(x, y)


@pytest.mark.parametrize(("turn", "sense"), [("left", 1.0), ("right", -1.0)])
def test_positive_speed_carries_along_travel_in_both_senses(turn: str, sense: float) -> None:
    """The bottle runs at mu g up to the speed of the belt, v / (2 mu g) behind in time, and turns at v / r from then.

    Friction holds it on the circle with a slip s at which mu g p(s) = v^2 / r; it drifts outward at that slip.
    """
    duration = 1.0
    encoder = {"acceleration": 1e6, "pulses_per_metre": 1e4}
    start = -0.25 * math.pi - sense * 0.2 * math.pi
    sim = on_bend(bend(turn, speed=V, drive=encoder), start, **LEDGER)
    sim.advance(round(duration / 0.01))
    angle, distance = seen(sim)
    drift = 0.01 * (1.0 - math.sqrt(1.0 - V**2 / RADIUS / (MU * G)))
    travelled = V * (duration - V / (2.0 * MU * G))
    assert sense * (angle - start) == pytest.approx(travelled / RADIUS, rel=5e-3)
    assert 0.0 < distance - RADIUS < 1.5 * drift * duration
    signals = dict(zip(sim.process_image.signal_names, sim.signals(), strict=True))
    assert signals["belts/bend/speed"] == V
    assert signals["belts/bend/pulses"] == pytest.approx(V * duration * 1e4, abs=1.0)
    assert signals["belts/bend/bottles"] == 1.0
    assert sim.belts().commanded.tolist() == sim.belts().actual.tolist() == [V]
    ledger = sim.ledger()
    assert ledger is not None
    assert ledger.belt_work[0] == pytest.approx(0.2 * V**2, rel=2e-2)
    assert ledger.residual == pytest.approx(0.0, abs=1e-6 * ledger.turnover)


def test_a_command_changes_a_right_hand_bend_along_travel() -> None:
    sim = on_bend(bend("right", speed=0.0), -0.1 * math.pi)
    sim.command(["belts/bend/cmd_speed"], [V])
    sim.advance(50)
    angle, _ = seen(sim)
    assert angle < -0.15 * math.pi
    sim.command(["belts/bend/cmd_speed"], [-V])
    sim.advance(100)
    assert seen(sim)[0] > angle


@pytest.mark.parametrize("turn", ["left", "right"])
@pytest.mark.parametrize("side", ["left", "right"])
def test_two_points_mean_the_same_belt_as_the_centre(turn: str, side: str) -> None:
    one, other = (on_bend(belt, -0.25 * math.pi) for belt in (bend(turn, speed=V), from_to(turn, side, speed=V)))
    for sim in (one, other):
        sim.advance(60)
    np.testing.assert_allclose(seen(other), seen(one), rtol=0.0, atol=1e-12)


def test_a_right_hand_bend_mirrors_a_left_hand_one() -> None:
    """Mirrored at the line of 45 degrees downward, on which the bottle starts."""
    left, right = (on_bend(bend(turn, speed=V), -0.25 * math.pi) for turn in ("left", "right"))
    for sim in (left, right):
        sim.advance(100)
    (angle, distance), (mirrored, alike) = seen(left), seen(right)
    assert angle + 0.25 * math.pi == pytest.approx(-(mirrored + 0.25 * math.pi), abs=1e-12)
    assert distance == pytest.approx(alike, abs=1e-12)


LANE = [
    {"kind": "straight", "start": [0.0, 0.0], "angle": 0.0, "length": 2.0, "width": 0.2, "ratio": 0.5},
    {"kind": "straight", "start": [0.0, 0.2], "angle": 0.0, "length": 2.0, "width": 0.2},
    {"kind": "straight", "start": [0.0, 0.4], "angle": 0.0, "length": 2.0, "width": 0.2, "ratio": 2.0},
]


def lanes(**more: Any) -> dict[str, Any]:
    """Three lanes of one belt with a bottle on each."""
    bottles = [bottle(0.2, 0.1 + 0.2 * lane) for lane in range(3)]
    path = {"kind": "path", "material": "chain", "speed": V, "surfaces": LANE}
    return {"base": BASE, "gravity": G, "bottles": bottles, "contacts": [contact(5000.0)], "belts": {"comb": path},
            **more}  # fmt: skip


def test_each_surface_runs_at_its_ratio() -> None:
    sim = simulation(**lanes(**LEDGER))
    sim.advance(100)
    np.testing.assert_allclose(sim.bottles().vx, [0.5 * V, V, 2.0 * V], rtol=1e-9)
    travelled = [v * (1.0 - v / (2.0 * MU * G)) for v in (0.5 * V, V, 2.0 * V)]
    np.testing.assert_allclose(sim.bottles().x - 0.2, travelled, rtol=5e-3)
    assert sim.bottles().belt.tolist() == [0, 0, 0]
    assert sim.belts().actual.tolist() == [V]
    signals = dict(zip(sim.process_image.signal_names, sim.signals(), strict=True))
    assert {name for name in signals if name.startswith("belts/")} == {
        "belts/comb/speed", "belts/comb/bottles", "belts/comb/mode",
    }  # fmt: skip
    assert signals["belts/comb/bottles"] == 3.0
    ledger = sim.ledger()
    assert ledger is not None and ledger.belt_work.shape == (2,)
    assert ledger.belt_work[0] == pytest.approx(0.2 * V**2 * (0.25 + 1.0 + 4.0), rel=1e-2)
    sim.command(["belts/comb/cmd_speed"], [-0.5 * V])
    sim.advance(100)
    np.testing.assert_allclose(sim.bottles().vx, [-0.25 * V, -0.5 * V, -V], rtol=1e-9)


def route(as_path: bool) -> dict[str, Any]:
    """A straight, a right-hand bend and a slower straight, crowded: as one path belt or as three belts; beside it one.

    Both ways have the same surfaces in the same order.
    """
    ring = {"kind": "curved", "centre": [0.5, -0.5], "inner_radius": 0.4, "width": 0.2, "start_angle": 0.0,
            "span": "90 deg", "turn": "right"}  # fmt: skip
    last = {"kind": "straight", "start": [0.9, -0.5], "angle": "-90 deg", "length": 0.4, "width": 0.2}
    pieces = [{"kind": "straight", "start": [0.0, -0.1], "angle": 0.0, "length": 0.5, "width": 0.2}, ring, last]
    ratios = [1.0, 1.0, 0.5]
    own = {"material": "chain", "speed": V}
    if as_path:
        surfaces = [{**piece, "ratio": ratio} for piece, ratio in zip(pieces, ratios, strict=True)]
        belts = {"line": {"kind": "path", **own, "surfaces": surfaces}}
    else:
        belts = {
            f"line_{n}": {**piece, **own, "speed": ratio * V}
            for n, (piece, ratio) in enumerate(zip(pieces, ratios, strict=True), 1)
        }
    feed = {"bottle": "bottle", "position": [0.1, 0.0], "direction": 0.0, "speed": V, "rate": 2.0}
    return {
        "base": BASE,
        "gravity": G,
        "contacts": [contact(5000.0, friction=0.1), contact(8000.0, "steel")],
        "bottle_types": {"bottle": kind(0.05, 0.2)},
        "belts": {**belts, "beside": belt(0.1, (0.0, 1.0), 1.0, 0.2)},
        "plates": {"end": {"kind": "straight", "start": [0.9, -0.9], "angle": "-90 deg", "length": 0.3, "width": 0.2,
                           "material": "nylon"}},
        "rails": {"stop": segment((0.8, -1.15), (1.2, -1.15))},
        "infeeds": {"feed": feed},
        "bottles": [bottle(0.1, 1.1)],
        **LEDGER,
    }  # fmt: skip


def test_a_path_belt_carries_like_separate_belts() -> None:
    path, separate = (simulation(**route(as_path)) for as_path in (True, False))
    for _ in range(9):
        for sim in (path, separate):
            sim.advance(100)
        one, other = path.bottles(), separate.bottles()
        for column in ("id", "x", "y", "theta", "vx", "vy", "omega"):
            np.testing.assert_array_equal(getattr(one, column), getattr(other, column), err_msg=column)
        belts = np.array([0, 0, 0, 1, -1])
        np.testing.assert_array_equal(one.belt, belts[other.belt])
        carried = np.bincount(other.belt[other.belt >= 0], minlength=4)
        signals = dict(zip(path.process_image.signal_names, path.signals(), strict=True))
        assert signals["belts/line/bottles"] == carried[:3].sum() and signals["belts/beside/bottles"] == carried[3]
    assert set(separate.bottles().belt.tolist()) == {-1, 0, 1, 2, 3}
    whole, parts = path.ledger(), separate.ledger()
    assert whole is not None and parts is not None
    np.testing.assert_allclose(whole.belt_work, [parts.belt_work[:3].sum(), parts.belt_work[3], 0.0], rtol=1e-12)
    assert (whole.base_friction, whole.residual) == pytest.approx((parts.base_friction, parts.residual), rel=1e-9)


def test_a_line_with_path_belts_goes_on_from_a_checkpoint(tmp_path: Path) -> None:
    sim = simulation(**route(True))
    sim.advance(300)
    sim.command(["belts/line/cmd_speed"], [0.2])
    sim.save(tmp_path / "checkpoint")
    loaded = Simulation.load(tmp_path / "checkpoint")
    for each in (sim, loaded):
        each.advance(200)
    assert loaded.full_state_hash() == sim.full_state_hash()


def plate(**more: Any) -> dict[str, Any]:
    return {"kind": "straight", "start": [-1.0, -1.0], "angle": 0.0, "length": 4.0, "width": 2.0, "material": "nylon",
            **more}  # fmt: skip


def ring_plate() -> dict[str, Any]:
    """The area of a curved plate that covers the path of a bottle from the origin along x."""
    return {"kind": "curved", "centre": [0.0, -0.5], "inner_radius": 0.0, "width": 2.0, "start_angle": 0.0,
            "span": "360 deg", "material": "nylon"}  # fmt: skip


@pytest.mark.parametrize("area", [plate(), ring_plate()], ids=["straight", "curved"])
def test_a_plate_slows_a_bottle_by_mu_g(area: dict[str, Any]) -> None:
    """Above v_lim friction is mu m g; a belt below the plate does not carry."""
    start, mu = 0.8, 0.25
    below = belt(1.0, (-1.0, -1.0), 4.0, 2.0)
    for belts in ({}, {"below": below}):
        sim = simulation(base=BASE, gravity=G, belts=belts, plates={"dead": area}, bottles=[bottle(0.0, 0.0, start)])
        sim.advance(20)
        state = sim.bottles()
        assert state.vx[0] == pytest.approx(start - mu * G * 0.2, rel=1e-9)
        assert state.x[0] == pytest.approx(start * 0.2 - 0.5 * mu * G * 0.2**2, rel=1e-3)
        assert state.belt.tolist() == [-1]
        sim.advance(100)
        assert math.hypot(sim.bottles().vx[0], sim.bottles().vy[0]) < 1e-6
        assert [name for name in sim.process_image.signal_names if "dead" in name] == []
        assert sim.belts().actual.size == len(belts)
        if belts:
            signals = dict(zip(sim.process_image.signal_names, sim.signals(), strict=True))
            assert signals["belts/below/bottles"] == 0.0


def test_springs_hold_a_bottle_on_a_plate() -> None:
    """On a plate the spring of static friction ends at a fixed point; the floor without a belt has none."""
    spring = {"stiffness": 400.0, "damping": 5.0}
    sim = simulation(
        base=[{"between": ["glass", "nylon"], "friction": 0.25, "tangential": spring}],
        gravity=G, plates={"dead": plate()}, bottles=[bottle(0.0, 0.0, 0.1), bottle(9.0, 0.0, 0.1)],
        contacts=[contact(5000.0)],
    )  # fmt: skip
    assert sim.model.has("static_friction")
    sim.advance(300)
    assert sim.bottles().vx == pytest.approx([0.0, 0.1], abs=1e-9)


def test_loads_and_steps_know_the_surfaces_of_path_belts() -> None:
    """A path belt and separate belts give the same model; a plate adds friction without drive."""
    path, separate = (simulation(**route(as_path)).model for as_path in (True, False))
    assert path.dt == separate.dt
    assert path.load == separate.load
    assert [impact.force for impact in path.impacts] == [impact.force for impact in separate.impacts]
    np.testing.assert_array_equal(path.base_friction, separate.base_friction)
    assert path.belts == ("line", "beside")
    assert [shape.name for shape in path.plant.surfaces] == ["line_1", "line_2", "line_3", "beside", "end"]


def test_the_fastest_surface_counts_in_the_speed_of_impacts() -> None:
    fields = lanes()
    assert simulation(**fields).model.plant.impact_speed == pytest.approx(2.0 * V)
    assert scene(**fields).belts["comb"].speed == V
