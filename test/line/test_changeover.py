# SPDX-License-Identifier: Apache-2.0
"""Changeover to another format in a run, by recorded commands."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.errors import CommandError, SceneError
from conveyor_sim.line.changeover import changeover
from conveyor_sim.line.machines.packml import Command
from conveyor_sim.physics.plant import Plant
from conveyor_sim.scene import Scene, parse_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.testing.scenario import Scenario

LINE = """\
name: formats
duration: 10
seed: 3
parameters: {speed: 0.3 m/s, rate: 3 /s, gap: 90 mm}
contacts:
  - {between: [glass, glass], stiffness: 20 kN/m, damping: {law: normal, restitution: 0.5}}
  - {between: [glass, steel], stiffness: 20 kN/m, damping: {law: normal, restitution: 0.5}}
base: [{between: [glass, chain], friction: 0.3}]
bottle_types:
  full: {radius: 35 mm, mass: 400 g, material: glass}
  half: {radius: 25 mm, mass: 200 g, material: glass}
drives: {m1: {speed: speed}}
conveyors:
  lane: {start: [0, 0], path: [{straight: 3}], width: 0.1, material: chain, drive: m1,
    guides: {clearance: gap, material: steel}}
  other: {start: [0, 1], path: [{straight: 3}], width: 0.1, material: chain, speed: 0.2}
  packed: {start: [0, 2], path: [{straight: 3}], width: 0.1, material: chain, speed: 0.3}
infeeds:
  inlet: {along: lane, at: 0.2, bottle: full, types: [full, half], rate: rate, rate_limit: 6 /s}
  packed: {along: packed, at: 0.2, bottle: full, types: [half, full], gap: 0}
machines:
  filler: {kind: source, along: other, at: 0.2, bottle: full, types: [full, half], rate: rate, rate_limit: 8 /s}
outfeeds:
  end: {along: lane, at: -0.05, length: 0.3}
  other: {along: other, at: -0.05, length: 0.3}
  packed: {along: packed, at: -0.05, length: 0.3}
formats:
  full: {bottle: full}
  half: {bottle: half, set: {rate: 5 /s, speed: 0.4 m/s}}
  narrow: {bottle: half, set: {gap: 80 mm}}
  fast: {set: {rate: 20 /s}}
format: full
"""
HALF = {
    "drives/m1/cmd_speed": 0.4,
    "infeeds/inlet/rate": 5.0,
    "infeeds/inlet/cmd_bottle": 1.0,
    "infeeds/packed/cmd_bottle": 0.0,
    "machines/filler/rate": 5.0,
    "machines/filler/cmd_bottle": 1.0,
}


@pytest.fixture(scope="module")
def line() -> Scene:
    return parse_scene(LINE, "line.yaml")


@pytest.fixture(scope="module")
def recorded(line: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    bag = tmp_path_factory.mktemp("changeover") / "bag"
    with Scenario(line, bag=bag) as plant:
        plant.run_for(3.0)
        plant.changeover("half")
        plant.run_for(4.0)
        plant.changeover("full")
        plant.run_for(3.0)
    return bag


def test_commands_of_a_format(line: Scene) -> None:
    assert changeover(line, "half") == HALF
    assert changeover(line, "full")["infeeds/inlet/rate"] == 3.0
    assert changeover(line, "full").keys() == HALF.keys()


def test_commands_do_not_depend_on_the_format_at_the_start(line: Scene) -> None:
    assert changeover(parse_scene(LINE, "line.yaml", {"format": "half"}), "half") == HALF


def test_bottles_of_both_types_enter_one_after_the_other(recorded: Path) -> None:
    with open_bag(recorded) as bag:
        kinds = list(bag.line.bottle_types)
        frames = [frame.data for frame in bag.bottles()]
    by_lane: dict[int, dict[int, str]] = {0: {}, 1: {}, 2: {}}
    for frame in frames:
        for number, y, kind in zip(frame.id, frame.y, frame.type, strict=True):
            by_lane[round(float(y))][int(number)] = kinds[kind]
    for bottles in by_lane.values():
        order = [bottles[number] for number in sorted(bottles)]
        changes = [kind for place, kind in enumerate(order) if place == 0 or order[place - 1] != kind]
        assert changes == ["full", "half", "full"]
    # 3 s at 3 /s, 4 s at 5 /s, 3 s at 3 /s
    assert len(by_lane[0]) == pytest.approx(38, abs=2)


def test_packed_bottles_of_two_types_touch(line: Scene) -> None:
    simulation = Simulation(line)
    simulation.advance(300)
    simulation.command(["infeeds/packed/cmd_bottle"], [0.0])
    simulation.advance(150)
    columns = simulation.bottles()
    lane = np.flatnonzero(columns.y > 1.5)
    order = lane[np.argsort(columns.x[lane])]
    radius = np.array([0.035, 0.025])[columns.type[order]]
    assert set(columns.type[order]) == {0, 1}
    gaps = np.diff(columns.x[order]) - radius[1:] - radius[:-1]
    assert abs(gaps[1:-1]).max() < 1e-3


def test_a_recorded_changeover_replays_exactly(recorded: Path) -> None:
    report = replay(recorded)
    assert report.exact and report.difference is None


def test_a_checkpoint_after_a_changeover_goes_on_exactly(line: Scene, tmp_path: Path) -> None:
    one = Simulation(line)
    one.command(list(HALF), list(HALF.values()))
    one.advance(150)
    one.save(tmp_path / "half.npz")
    other = Simulation.load(tmp_path / "half.npz")
    for simulation in (one, other):
        simulation.command(["infeeds/inlet/rate", "infeeds/packed/cmd_bottle"], [1.5, 1.0])
        simulation.advance(100)
    assert one.full_state_hash() == other.full_state_hash()


PANEL = """\
panel:
  estop: {kind: emergency_stop, cuts: [drives, machines], deceleration: 1 m/s^2}
"""
MOVED = ("belts/lane", "belts/other", "belts/packed")


def stopped(plant: Scenario, first: str) -> None:
    """Press the emergency stop and change the format. first: of both; or `braking`, `latched`: when the format changes.

    Return when the belts stand.
    """
    if first == "changeover":
        plant.changeover("half")
    plant.panel.press("estop")
    plant.run_for({"braking": 0.1, "latched": 1.0}.get(first, 0.0))
    if first != "changeover":
        plant.changeover("half")
    plant.run_for(1.0)
    assert "panel/estop/pressed" in plant.alarms


def restart(plant: Scenario) -> None:
    """Give the start commands of drives, belts without a drive, and the machine."""
    plant.command("machines/filler/cntrl_cmd", Command.CLEAR)
    for on in (0.0, 1.0):
        plant.run_for(0.1)
        plant.command("drives/m1/run", on)
        plant.command("machines/filler/run", on)
        for belt in ("other", "packed"):
            plant.command(f"belts/{belt}/cmd_speed", 0.3 * on)


def stands(plant: Scenario) -> bool:
    present = plant.signals
    return all(present[f"{belt}/speed"] == 0.0 for belt in MOVED) and not present["machines/filler/running"]


@pytest.mark.parametrize("first", ["stop", "changeover", "braking", "latched"])
def test_an_emergency_stop_during_a_changeover(tmp_path: Path, first: str) -> None:
    """The format that was commanded without power is in force after the restart, and nothing starts before."""
    with Scenario(parse_scene(LINE + PANEL, "line.yaml"), bag=tmp_path / "bag") as plant:
        plant.run_for(2.0)
        stopped(plant, first)
        assert stands(plant)
        produced = plant.signals["machines/filler/produced"]
        plant.panel.reset("estop")
        plant.run_for(1.0)
        assert stands(plant) and plant.alarms == {"machines/filler/fault"}
        assert plant.signals["machines/filler/produced"] == produced
        restart(plant)
        plant.run_for(4.0)
        made = plant.signals["machines/filler/produced"] - produced
        speeds = [plant.signals[f"{belt}/speed"] for belt in MOVED]
    assert speeds == [0.4, 0.3, 0.3]
    assert made == pytest.approx(4 * 5, abs=2)
    report = replay(tmp_path / "bag")
    assert report.exact and report.difference is None
    with open_bag(tmp_path / "bag") as bag:
        kinds, frames = list(bag.line.bottle_types), [frame.data for frame in bag.bottles()]
    born = {
        int(n): (round(float(y)), kinds[kind])
        for frame in frames
        for n, y, kind in zip(frame.id, frame.y, frame.type, strict=True)
    }
    for lane in range(3):
        order = [kind for _, (y, kind) in sorted(born.items()) if y == lane]
        assert order == sorted(order) and set(order) == {"full", "half"}


def test_a_checkpoint_between_stop_and_restart_of_a_changeover_goes_on_exactly(tmp_path: Path) -> None:
    line = parse_scene(LINE + PANEL, "line.yaml")
    with Scenario(line) as one:
        one.run_for(2.0)
        stopped(one, "braking")
        one.save(tmp_path / "latched.npz")
        with Scenario(line, start=tmp_path / "latched.npz") as other:
            for plant in (one, other):
                plant.panel.reset("estop")
                plant.run_for(0.1)
                restart(plant)
                plant.run_for(2.0)
            assert one.simulation.full_state_hash() == other.simulation.full_state_hash()
            assert one.signals["machines/filler/produced"] == other.signals["machines/filler/produced"] > 6


def test_a_rate_of_zero_stops_and_is_not_caught_up(line: Scene) -> None:
    simulation = Simulation(line)

    def fed() -> float:
        names = list(simulation.process_image.signal_names)
        return float(simulation.signals()[names.index("infeeds/inlet/fed")])

    simulation.command(["infeeds/inlet/rate"], [0.0])
    simulation.advance(300)
    assert fed() <= 1
    simulation.command(["infeeds/inlet/rate"], [3.0])
    simulation.advance(100)
    assert fed() <= 5


@pytest.mark.parametrize(
    ("format", "facts"),
    [
        ("narrow", ["formats.narrow", "rails.lane_", "at the start"]),
        ("thin", ["thin", "formats"]),
    ],
)
def test_what_commands_can_not_do_is_refused(line: Scene, format: str, facts: list[str]) -> None:
    with pytest.raises(SceneError) as error:
        changeover(line, format)
    assert len(str(error.value).splitlines()) == 1
    assert all(fact in str(error.value) for fact in facts), str(error.value)


def test_a_feeder_without_types_is_named() -> None:
    scene = parse_scene(LINE.replace("types: [half, full], ", ""), "line.yaml")
    with pytest.raises(SceneError, match=r"infeeds\.packed\.bottle.*types"):
        changeover(scene, "half")


def test_a_machine_needs_a_rate_limit_for_a_higher_rate() -> None:
    scene = parse_scene(LINE.replace(", rate_limit: 8 /s", ""), "line.yaml")
    with pytest.raises(SceneError, match=r"machines\.filler\.rate: 5.*rate_limit"):
        changeover(scene, "half")


def test_an_invalid_format_is_refused(line: Scene) -> None:
    with pytest.raises(SceneError, match=r"machines\.filler\.rate_limit"):
        changeover(line, "fast")


def test_only_feeders_with_a_choice_have_the_commands(line: Scene) -> None:
    text = LINE.replace("types: [full, half], ", "").replace("types: [half, full], ", "")
    plain = parse_scene(text.replace(", rate_limit: 6 /s", ""), "line.yaml", {"format": "full"})
    names = set(Simulation(line).process_image.command_names) - set(Simulation(plain).process_image.command_names)
    assert names == {
        "infeeds/inlet/rate", "infeeds/inlet/cmd_bottle", "infeeds/packed/cmd_bottle", "machines/filler/cmd_bottle",
    }  # fmt: skip


@pytest.mark.parametrize("value", [2.0, -1.0, 0.5, float("nan")])
def test_a_value_that_is_no_type_is_refused(line: Scene, value: float) -> None:
    with Scenario(line) as plant, pytest.raises(CommandError):
        plant.command("infeeds/inlet/cmd_bottle", value)


@pytest.mark.parametrize(
    ("changes", "place", "fact"),
    [
        ({"types": ["half"]}, "formats.full.bottle", "half"),
        ({"types": ["full", "full"]}, "infeeds.inlet.types", "once"),
        ({"types": ["full", "thin"]}, "infeeds.inlet.types", "bottle_types"),
        ({"rate_limit": 2}, "infeeds.inlet.rate_limit", "at least 3"),
        ({"timing_jitter": 0.1}, "infeeds.inlet.timing_jitter", "0.08"),
        ({"types": "full"}, "infeeds.inlet.types", "list of bottle types"),
    ],
)
def test_bad_choices_are_refused(changes: dict[str, Any], place: str, fact: str) -> None:
    with pytest.raises(SceneError) as error:
        parse_scene(LINE, "line.yaml", {"infeeds": {"inlet": changes}})
    assert place in str(error.value) and fact in str(error.value), str(error.value)


def test_the_model_knows_all_types_that_can_enter(line: Scene) -> None:
    assert set(Plant.of(line).supply) == {"full", "half"}
    assert (
        Simulation(line).model.steps_per_tick
        >= Simulation(
            parse_scene(LINE.replace("types: [full, half], ", "").replace("types: [half, full], ", ""), "line.yaml")
        ).model.steps_per_tick
    )


GUIDED = """\
name: guided
duration: 10
parameters: {speed: 0.3 m/s, size: 0}
contacts:
  - {between: [glass, glass], stiffness: 20 kN/m, damping: {law: normal, restitution: 0.5}}
  - {between: [glass, steel], stiffness: 20 kN/m, damping: {law: normal, restitution: 0.5}}
base: [{between: [glass, chain], friction: 0.3}]
bottle_types: {full: {radius: 35 mm, mass: 400 g, material: glass}, half: {radius: 25 mm, mass: 200 g, material: glass}}
conveyors: {lane: {start: [0, 0], path: [{straight: 3}], width: 0.1, material: chain, speed: speed}}
adjustable:
  left: &guide {along: lane, from: 1, to: 2, side: left, positions: [40 mm, 30 mm], setting: size, max_speed: 0.05,
    acceleration: 0.5, material: steel}
  right: {<<: *guide, side: right, positions: [40 mm, 40 mm, 35 mm], setting: 0}
infeeds: {inlet: {along: lane, at: 0.2, bottle: full, types: [full, half], rate: 1 /s}}
formats:
  full: {bottle: full}
  half: {bottle: half, set: {size: 1}}
format: full
"""


def test_a_changeover_moves_guides_to_their_setting_of_the_format() -> None:
    """Only guides whose setting depends on the format move; bottles then pass between them."""
    scene = parse_scene(GUIDED, "guided.yaml")
    commands = changeover(scene, "half")
    assert commands == {"infeeds/inlet/cmd_bottle": 1.0, "adjustable/left/cmd_setting": 1.0}
    assert changeover(scene, "full") == {"infeeds/inlet/cmd_bottle": 0.0, "adjustable/left/cmd_setting": 0.0}
    simulation = Simulation(scene)
    simulation.command(list(commands), list(commands.values()))
    simulation.advance(100)
    left, right = (shape.pieces[0] for shape in simulation.moving_rails())
    assert (left.p1[1], left.p2[1]) == pytest.approx((0.03, 0.03), abs=1e-9)
    assert (right.p1[1], right.p2[1]) == pytest.approx((-0.04, -0.04), abs=1e-9)
    assert parse_scene(GUIDED, "guided.yaml", {"format": "half"}).adjustable["left"].setting == 1
