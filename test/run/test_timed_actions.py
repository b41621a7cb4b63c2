# SPDX-License-Identifier: Apache-2.0
"""Timed actions of an operator: files in CSV and YAML, their errors, and runs with them, which replay bit for bit."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner
from facts import missing

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.cli.command import main
from conveyor_sim.control.start_stop import panel_line
from conveyor_sim.errors import CommandError, ConveyorError
from conveyor_sim.run.runner import run_scene
from conveyor_sim.run.timed_actions import TimedActions
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.resources import scene_path

CSV = """time,action
0.1,press start

0.105 s,set speed 0.4
0.25 s,release start
0.3 s,turn mode auto
2,press estop
2.5 s,reset estop
"""
YAML = """
- {time: 0.1, action: press start}
- {time: 105 ms, action: set speed 0.4}
- {time: 0.25 s, action: release start}
- {time: 0.3 s, action: turn mode 1}
- {time: 2, action: press estop}
- {time: 2.5 s, action: reset estop}
"""
GIVEN = [
    (10, "panel/start/press", 1.0),
    (11, "panel/speed/set", 0.4),
    (25, "panel/start/press", 0.0),
    (30, "panel/mode/turn", 1.0),
    (200, "panel/estop/press", 1.0),
    (250, "panel/estop/reset", 1.0),
]


@pytest.fixture(scope="module")
def simulation() -> Simulation:
    return Simulation(load_scene(scene_path("scenarios/panel_line"), {"duration": 3.0}))


def written(folder: Path, text: str, suffix: str = "csv") -> Path:
    path = folder / f"actions.{suffix}"
    path.write_text(text)
    return path


@pytest.mark.parametrize(("text", "suffix"), [(CSV, "csv"), (YAML, "yaml")])
def test_a_run_with_actions_replays_bit_for_bit(text: str, suffix: str, tmp_path: Path) -> None:
    scene = load_scene(scene_path("scenarios/panel_line"), {"duration": 3.0})
    actions = written(tmp_path, text, suffix)
    run_scene(scene, tmp_path / "bag", controller=panel_line(), actions=actions)
    with open_bag(tmp_path / "bag") as bag:
        outcomes = [(frame.tick, frame.data) for frame in bag.read("outcomes")]
    given = [
        (tick, name, value)
        for tick, outcome in outcomes
        for name, value in zip(outcome.names, outcome.values, strict=True)
        if outcome.writer_kind == "operator"
    ]
    assert given == GIVEN and all(outcome.accepted for _, outcome in outcomes)
    report = replay(tmp_path / "bag")
    assert report.difference is None


@pytest.mark.parametrize(
    ("text", "facts"),
    [
        ("", [":1:", "time,action"]),
        ("action,time\n", [":1:", "action,time", "time,action"]),
        ("time,action\n1,press start,2\n", [":2:", "3 cells", "time", "action"]),
        ("time,action\nsoon,press start\n", [":2:", "time", "soon", "0 s"]),
        ("time,action\n-1,press start\n", [":2:", "time", "-1", "0 s or more"]),
        ("time,action\nnan,press start\n", [":2:", "time", "nan"]),
        ("time,action\n1e400,press start\n", [":2:", "time", "1e400"]),
        ("time,action\n2 m,press start\n", [":2:", "time", "2 m"]),
        ("time,action\n1,\n", [":2:", "action", "press", "turn"]),
        ("time,action\n1,push start\n", [":2:", "action", "push", "press", "release"]),
        ("time,action\n1,press strat\n", [":2:", "action", "strat", "estop", "start"]),
        ("time,action\n1,press mode\n", [":2:", "action", "mode", "start"]),
        ("time,action\n1,release estop\n", [":2:", "action", "estop", "start"]),
        ("time,action\n1,press start 1\n", [":2:", "action", "1 given", "no value"]),
        ("time,action\n1,turn mode\n", [":2:", "action", "None given", "a value"]),
        ("time,action\n1,turn mode on\n", [":2:", "action", "on given", "off, auto"]),
        ("time,action\n1,turn mode 2\n", [":2:", "action", "2 given", "off, auto"]),
        ("time,action\n1,set speed 9\n", [":2:", "action", "9 given", "0.1 to 0.5 m/s"]),
        ("time,action\n1,set speed nan\n", [":2:", "action", "nan given", "0.1 to 0.5 m/s"]),
        ("time,action\n1,set made 5\n", [":2:", "action", "made", "speed"]),
        ('time,action\n1,"press\n', ["not valid CSV"]),
    ],
    ids=str,
)
def test_a_wrong_line_is_refused_with_its_number(
    text: str, facts: list[str], tmp_path: Path, simulation: Simulation
) -> None:
    path = written(tmp_path, text)
    with pytest.raises(CommandError) as refused:
        TimedActions(path, simulation)
    assert missing(str(refused.value), str(path), *facts) == [] and "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("text", "facts"),
    [
        ("", ["empty"]),
        ("time: 1\n", [":1:", "list"]),
        ("- press start\n", [":1:", "str", "time", "action"]),
        ("- {time: 1, action: press start}\n- {time: 2}\n", [":2:", "time", "action"]),
        ("- {time: [1], action: press start}\n", [":1:", "time", "[1]"]),
        ("- {time: true, action: press start}\n", [":1:", "time", "True"]),
        ("- {time: 1, action: 5}\n", [":1:", "action", "press"]),
        ("- {time: 1, action: [\n", ["not valid YAML"]),
    ],
    ids=str,
)
def test_a_wrong_entry_is_refused_with_its_line(
    text: str, facts: list[str], tmp_path: Path, simulation: Simulation
) -> None:
    path = written(tmp_path, text, "yaml")
    with pytest.raises(ConveyorError) as refused:
        TimedActions(path, simulation)
    assert missing(str(refused.value), str(path), *facts) == [] and "\n" not in str(refused.value)


def test_files_that_cannot_be_read_are_refused(tmp_path: Path, simulation: Simulation) -> None:
    binary = tmp_path / "binary.csv"
    binary.write_bytes(b"time,action\n\xff\xfe")
    for path in (tmp_path / "absent.csv", tmp_path, binary):
        with pytest.raises(CommandError) as refused:
            TimedActions(path, simulation)
        assert missing(str(refused.value), str(path)) == []


def test_the_command_refuses_a_wrong_file_before_it_records(tmp_path: Path) -> None:
    path = written(tmp_path, "time,action\n1,press strat\n")
    out = tmp_path / "out"
    result = CliRunner().invoke(main, ["run", "scenarios/panel_line", "--actions", str(path), "--out", str(out)])
    assert result.exit_code != 0 and not out.exists()
