# SPDX-License-Identifier: Apache-2.0
"""Movers with several positions: their tags, strokes between any two positions, and what they displace."""

import math
from typing import Any

import numpy as np
import pytest
from physics.test_moving_rails import plant
from scenes import RADIUS, bottle

from conveyor_sim.simulation import Simulation

TOP, ACCELERATION = 0.5, 2.0
ANGLES = (-0.4, 0.1, 0.5)
"""rad, of the lanes of the swinging divider."""
PLACES = (0.30, 0.05, 0.20)
"""m, of the lanes of the sliding divider: they are in no order."""
MOVES: dict[str, Any] = {"material": "steel", "max_speed": TOP, "acceleration": ACCELERATION}


def line(*bottles: dict[str, Any], **more: Any) -> Simulation:
    """Return a line with a swinging divider about (0, 5), a sliding one along x, and a guide along y."""
    dividers = {
        "arm": {"kind": "swing", "from": [0.0, 5.0], "to": [0.4, 5.0], "positions": list(ANGLES), "lane": 1, **MOVES},
        "shuttle": {"kind": "slide", "from": [0.0, -0.2], "to": [0.0, 0.2], "direction": 0.0,
                    "positions": list(PLACES), "lane": 1, **MOVES},
    }  # fmt: skip
    guide = {"from": [5.0, 5.0], "to": [6.0, 5.0], "direction": "90 deg", "positions": [0.0, 0.01], **MOVES}
    fields = {"pushers": {}, "diverters": {}, "gates": {}, "dividers": dividers, "adjustable": {"guide": guide}, **more}
    return plant(*bottles, **fields)


def signals(sim: Simulation, device: str) -> dict[str, float]:
    """Return the signals of a device by their last name."""
    named = zip(sim.process_image.signal_names, sim.signals().tolist(), strict=True)
    return {name.rpartition("/")[2]: value for name, value in named if name.startswith(f"{device}/")}


def stroke_time(distance: float) -> float:
    """Return the time (s) of a stroke from rest to rest."""
    if distance < TOP**2 / ACCELERATION:
        return 2.0 * math.sqrt(distance / ACCELERATION)
    return distance / TOP + TOP / ACCELERATION


def test_the_process_image_has_them() -> None:
    image = line().process_image
    assert [name for name in image.signal_names if name.startswith("dividers/arm/")] == [
        f"dividers/arm/{what}" for what in ("position", "lane", "in_position", "blocked", "mode")
    ]
    assert image.command_names[1:] == (
        "dividers/arm/cmd_lane", "dividers/shuttle/cmd_lane", "adjustable/guide/cmd_setting",
    )  # fmt: skip
    assert [(tag.kind, tag.low, tag.high, tag.initial) for tag in image.commands[1:]] == [
        ("count", 0.0, 2.0, 1.0), ("count", 0.0, 2.0, 1.0), ("count", 0.0, 1.0, 0.0),
    ]  # fmt: skip
    initial = {tag.name: tag.initial for tag in image.signals}
    sim = line()
    assert signals(sim, "dividers/arm") == {
        "position": pytest.approx(0.5 / 0.9), "lane": 1.0, "in_position": 1.0, "blocked": 0.0, "mode": 1.0,
    }  # fmt: skip
    assert initial["dividers/arm/lane"] == 1.0
    assert signals(sim, "dividers/shuttle")["position"] == initial["dividers/shuttle/position"] == 0.0


@pytest.mark.parametrize(("device", "places"), [("arm", ANGLES), ("shuttle", PLACES)])
def test_it_moves_from_lane_to_lane_in_the_time_of_the_distance(device: str, places: tuple[float, ...]) -> None:
    sim, name = line(), f"dividers/{device}"
    for before, lane in ((1, 0), (0, 2), (2, 1)):
        ticks = round(100.0 * stroke_time(abs(places[lane] - places[before])), 6)
        sim.command([f"{name}/cmd_lane"], [lane])
        sim.advance(1)
        assert signals(sim, name)["in_position"] == 0.0
        sim.advance(math.floor(ticks) - 4)
        assert signals(sim, name)["lane"] == -1.0
        sim.advance(6)
        seen = signals(sim, name)
        assert (seen["lane"], seen["in_position"]) == (lane, 1.0)
        share = (places[lane] - min(places)) / (max(places) - min(places))
        assert seen["position"] == pytest.approx(share, abs=1e-12)


def test_a_lane_that_it_passes_is_reported_although_it_is_not_wanted() -> None:
    """`lane` is a measurement, `in_position` compares it with the setpoint."""
    sim = line()
    sim.command(["dividers/shuttle/cmd_lane"], [0])
    seen = set()
    for _ in range(80):
        sim.advance(1)
        shuttle = signals(sim, "dividers/shuttle")
        seen.add((shuttle["lane"], shuttle["in_position"]))
    assert seen >= {(-1.0, 0.0), (0.0, 1.0)}
    assert (2.0, 1.0) not in seen


def test_a_command_during_a_stroke_is_taken_from_the_present_place() -> None:
    sim = line()
    sim.command(["dividers/shuttle/cmd_lane"], [0])
    sim.advance(20)
    sim.command(["dividers/shuttle/cmd_lane"], [2])
    sim.advance(100)
    assert signals(sim, "dividers/shuttle")["lane"] == 2.0


def test_a_jammed_divider_stands_between_lanes() -> None:
    sim = line()
    sim.command(["dividers/arm/cmd_lane"], [2])
    sim.advance(20)
    sim.inject("dividers/arm/jammed", 1)
    sim.advance(1)
    before = signals(sim, "dividers/arm")
    sim.advance(50)
    assert signals(sim, "dividers/arm") == before
    assert (before["lane"], before["in_position"]) == (-1.0, 0.0)
    sim.inject("dividers/arm/jammed", 0)
    sim.advance(100)
    assert signals(sim, "dividers/arm")["lane"] == 2.0


@pytest.mark.parametrize("value", [-1.0, 3.0, 0.5])
def test_a_lane_that_it_does_not_have_is_refused(value: float) -> None:
    sim = line()
    sim.command(["dividers/arm/cmd_lane"], [value])
    sim.advance(100)
    assert (signals(sim, "dividers/arm")["lane"], signals(sim, "dividers/arm")["in_position"]) == (1.0, 1.0)


def test_a_sliding_divider_displaces_a_bottle_by_its_stroke_and_the_way_it_slides_on() -> None:
    """s - v^2 / 2a to where the rail brakes faster than friction, then v^2 / (2 mu g)."""
    mu, brake, place = 0.4, 50.0, PLACES[1] + RADIUS
    slide = {"kind": "slide", "from": [0.0, -0.2], "to": [0.0, 0.2], "direction": 0.0, "positions": list(PLACES),
             "lane": 1, **MOVES, "acceleration": brake, "force_limit": "none"}  # fmt: skip
    sim = line(bottle(place, 0.0), floor={"friction": mu}, dividers={"shuttle": slide})
    sim.command(["dividers/shuttle/cmd_lane"], [0])
    sim.advance(300)
    way = (PLACES[0] - PLACES[1]) - TOP**2 / (2.0 * brake) + TOP**2 / (2.0 * mu * 9.81)
    # The impact of the damped spring against the rail adds up to a / omega to the speed.
    omega = math.sqrt(8e3 / 0.35)
    spread = (brake / omega) * TOP / (mu * 9.81)
    assert float(sim.bottles().x[0]) - place == pytest.approx(way, abs=1.5 * spread)


def test_a_swinging_divider_leaves_a_bottle_beside_it() -> None:
    """Slowly, against friction: the bottle ends a radius from the arm, as far from the pivot as it was."""
    near = 0.25
    start = (near * math.cos(ANGLES[1]) - RADIUS * math.sin(ANGLES[1]),
             5.0 + near * math.sin(ANGLES[1]) + RADIUS * math.cos(ANGLES[1]))  # fmt: skip
    arm = {"kind": "swing", "from": [0.0, 5.0], "to": [0.4, 5.0], "positions": list(ANGLES), "lane": 1, **MOVES,
           "material": "ice", "max_speed": 0.2}  # fmt: skip
    sim = line(bottle(*start), floor={"friction": 0.4}, dividers={"arm": arm})
    sim.command(["dividers/arm/cmd_lane"], [2])
    sim.advance(400)
    place = np.array([sim.bottles().x[0], sim.bottles().y[0] - 5.0])
    across = float(place @ [-math.sin(ANGLES[2]), math.cos(ANGLES[2])])
    assert across == pytest.approx(RADIUS, abs=1e-3)


def test_it_runs_on_from_a_checkpoint(tmp_path: Any) -> None:
    sim = line(bottle(PLACES[1] + 0.1, 0.0))
    sim.command(["dividers/shuttle/cmd_lane", "dividers/arm/cmd_lane"], [0, 2])
    sim.advance(20)
    sim.save(tmp_path / "state")
    again = Simulation.load(tmp_path / "state")
    for one in (sim, again):
        one.command(["dividers/arm/cmd_lane"], [0])
        one.advance(60)
    assert sim.state_hash() == again.state_hash()
    assert (sim.signals() == again.signals()).all()
