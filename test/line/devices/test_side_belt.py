# SPDX-License-Identifier: Apache-2.0
"""Side belts: their ramp and faults, and bottles that they grip and carry."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scenes import ROOT
from study_page import load_study

from conveyor_sim.errors import SceneError
from conveyor_sim.scene import parse_scene
from conveyor_sim.simulation import Simulation

SPEED = 0.6
GAP = (1.5, 2.1)
"""m, between both conveyors."""


def grippers() -> Simulation:
    """Return the line of docs/parts/side_belts.md with a floor without friction."""
    text = load_study("part_pictures").scene_text(ROOT / "docs" / "parts" / "side_belts.md")
    return Simulation(parse_scene(text, overrides={"floor": "none"}), threads=1)


def signal(sim: Simulation, name: str) -> float:
    """Return the value of a signal."""
    return float(sim.signals()[sim.process_image.signal_names.index(name)])


def in_gap(sim: Simulation) -> np.ndarray:
    """Return the speeds of bottles over the gap, m/s."""
    bottles = sim.bottles()
    return np.asarray(bottles.vx[(bottles.x > GAP[0] + 0.05) & (bottles.x < GAP[1] - 0.05)])


def test_grippers_carry_bottles_over_a_gap() -> None:
    """Bottles have the speed of the belts, and each side presses with the overlap times the stiffness."""
    sim = grippers()
    sim.advance(500)
    speeds = in_gap(sim)
    assert speeds.size >= 2 and speeds == pytest.approx(SPEED, rel=1e-3)
    contacts = sim.contacts()
    at_gap = (contacts.x > GAP[0] + 0.05) & (contacts.x < GAP[1] - 0.05) & (contacts.kind == 1)
    assert contacts.normal_force[at_gap] == pytest.approx(5e3 * 1e-3, rel=0.02)


def test_speed_ramps_and_the_bottles_follow() -> None:
    """The speed changes by the acceleration, here 1 m/s^2; grip is stronger than the inertia of a bottle."""
    sim = grippers()
    sim.advance(500)
    for side in ("left", "right"):
        sim.command([f"side_belts/{side}/cmd_speed"], [0.3])
    sim.advance(10)
    assert signal(sim, "side_belts/left/speed") == pytest.approx(SPEED - 0.1)
    assert signal(sim, "side_belts/left/at_speed") == 0.0
    assert in_gap(sim) == pytest.approx(SPEED - 0.1, abs=0.01)
    sim.advance(30)
    assert signal(sim, "side_belts/left/speed") == 0.3 and signal(sim, "side_belts/left/at_speed") == 1.0


def test_faults_and_the_run_command_slow_the_surface() -> None:
    """A jam stops it at once, slip takes a share of its speed, and without run it ramps down."""
    sim = grippers()
    sim.inject("side_belts/left/slip", 0.25)
    sim.inject("side_belts/right/jammed", 1.0)
    sim.advance(1)
    assert signal(sim, "side_belts/left/speed") == pytest.approx(0.75 * SPEED)
    assert signal(sim, "side_belts/right/speed") == 0.0
    sim.inject("side_belts/left/slip", 0.0)
    sim.command(["side_belts/left/run"], [0.0])
    sim.advance(61)
    assert signal(sim, "side_belts/left/speed") == 0.0


TRAVEL = 0.3
"""Travel of the surfaces per cycle of their axis, m."""


def text_on_an_axis(**changes: Any) -> str:
    """Return the line of docs/parts/side_belts.md whose belts follow, by an axis, the drive of both conveyors.

    changes: fields of both side belts.
    """
    given = yaml.safe_load(load_study("part_pictures").scene_text(ROOT / "docs" / "parts" / "side_belts.md"))
    for belt in given["side_belts"].values():
        del belt["speed"], belt["acceleration"]
        belt |= {"axis": "grip", "travel": TRAVEL, **changes}
    for conveyor in given["conveyors"].values():
        del conveyor["speed"]
        conveyor["drive"] = "main"
    given["drives"] = {"main": {"speed": SPEED, "acceleration": 1.0}}
    given["axes"] = {"grip": {"drive": "main", "travel": TRAVEL}}
    return str(yaml.safe_dump({**given, "floor": "none"}))


def test_belts_on_an_axis_keep_step_with_the_conveyors(tmp_path: Path) -> None:
    """They follow the ramp of the drive within half of its change in a tick, and travel as far as the axis says."""
    sim = Simulation(parse_scene(text_on_an_axis()), threads=1)
    assert not any(name.startswith("side_belts/") for name in sim.process_image.command_names)
    sim.advance(400)
    assert in_gap(sim) == pytest.approx(SPEED, rel=1e-3)
    sim.command(["drives/main/cmd_speed"], [0.3])
    sim.save(tmp_path / "there")
    loaded = Simulation.load(tmp_path / "there", threads=2)
    turned, travelled = 0.0, 0.0
    for tick in range(50):
        before = signal(sim, "axes/grip/position")
        for each in (sim, loaded):
            each.advance(1)
        speed = signal(sim, "side_belts/left/speed")
        assert abs(speed - signal(sim, "belts/discharge/speed")) < 0.006, tick
        turned += math.remainder(signal(sim, "axes/grip/position") - before, 2.0 * math.pi)
        travelled += speed * sim.scene.tick
    assert travelled == pytest.approx(TRAVEL * turned / (2.0 * math.pi), rel=1e-9)
    assert speed == pytest.approx(0.3) and in_gap(sim) == pytest.approx(0.3, rel=0.02)
    assert loaded.full_state_hash() == sim.full_state_hash()


def test_faults_of_a_belt_on_an_axis() -> None:
    """Slip takes a share of its speed; a jam blocks the axis, and with it the other belt."""
    sim = Simulation(parse_scene(text_on_an_axis()), threads=1)
    sim.inject("side_belts/left/slip", 0.25)
    sim.advance(1)
    assert signal(sim, "side_belts/left/speed") == pytest.approx(0.75 * SPEED)
    assert signal(sim, "side_belts/right/speed") == pytest.approx(SPEED)
    sim.inject("side_belts/left/jammed", 1.0)
    sim.advance(1)
    assert signal(sim, "side_belts/right/speed") == 0.0 == signal(sim, "axes/grip/speed")


def test_the_scene_of_a_belt_on_an_axis_can_be_read_again() -> None:
    belt = parse_scene(text_on_an_axis()).side_belts["left"]
    assert type(belt).model_validate(belt.model_dump(by_alias=True)) == belt


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"travel": None}, "side_belts.left.travel: none given with axis, expected the travel per cycle of the axis"),
        ({"axis": None}, "side_belts.left.travel: 0.3 given, expected it only with axis"),
        ({"axis": "none"}, 'side_belts.left.axis: "none" given, expected a name from axes: grip'),
        ({"speed": 0.6}, "side_belts.left.speed: 0.6 given, expected none here: axes.grip has it"),
        ({"acceleration": 1.0}, "side_belts.left.acceleration: 1 given, expected none here: axes.grip has it"),
        ({"travel": -0.3}, "side_belts.left.travel: -0.3 given, expected a number greater than 0 (m)"),
    ],
)
def test_which_fields_go_with_an_axis(changes: dict[str, Any], says: str) -> None:
    with pytest.raises(SceneError) as refused:
        parse_scene(text_on_an_axis(**changes))
    assert says in str(refused.value)
