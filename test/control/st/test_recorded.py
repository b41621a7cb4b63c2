# SPDX-License-Identifier: Apache-2.0
"""Recorded variables of programs: only the selected ones, after each scan, without any other effect."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from facts import missing, stating

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.bag.rerun import rerun
from conveyor_sim.cli import main
from conveyor_sim.control.recorded import RecordedVariables
from conveyor_sim.control.scan import ControlError, together
from conveyor_sim.control.st import StructuredText
from conveyor_sim.page.recording import Collector, Detail, PageRecording
from conveyor_sim.page.watch import Watch
from conveyor_sim.testing import Scenario

PROGRAMS = Path(__file__).parent.parent.parent.parent / "examples" / "st"
TABLE = Path(__file__).parent.parent.parent / "testing" / "table.yaml"
NAMES = ["plc/table/held", "plc/table/free/in", "plc/table/free/pt", "plc/table/free/q", "plc/table/free/et"]


def play(plant: Scenario, *record: str) -> list[tuple[int, list[float]]]:
    """Run the table with its program attached a little later, and return ticks and variables after their scans."""
    plant.run_for(0.1)
    plant.attach(StructuredText(PROGRAMS / "table.st", record=record))
    seen = []
    for _ in range(150):
        seen.append((plant.simulation.tick, [plant.signals[name] for name in NAMES]))
        plant.run_for(0.01)
    return [*seen, (plant.simulation.tick, [plant.signals[name] for name in NAMES])]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[tuple[int, list[float]]], int]:
    """Return a folder with a recording and its inputs, the observed variables, and the hash of the final state."""
    folder = tmp_path_factory.mktemp("recorded")
    with Scenario(TABLE, bag=folder / "bag", inputs=folder / "inputs") as plant:
        seen = play(plant, "table/held", "plc/Table/free/*")
        return folder, seen, plant.simulation.state_hash()


def rows(bag: Path) -> list[tuple[int, list[float]]]:
    with open_bag(bag) as opened:
        frames = list(opened.read("variables"))
    assert all(list(frame.data.name) == NAMES for frame in frames)
    return [(frame.tick, frame.data.value.tolist()) for frame in frames]


def test_a_recording_has_the_variables_of_each_scan_and_replays(recorded: tuple[Path, list, int]) -> None:
    folder, seen, state_hash = recorded
    assert rows(folder / "bag") == seen
    assert len({tuple(values) for _, values in seen}) > 100  # the timer's time goes on
    report = replay(folder / "bag")
    assert report.difference is None and report.last_tick == seen[-1][0]
    with Scenario(TABLE) as plant:
        play(plant)
        assert plant.simulation.state_hash() == state_hash


def test_a_recording_made_of_the_inputs_has_them_too(recorded: tuple[Path, list, int], tmp_path: Path) -> None:
    folder, seen, _ = recorded
    watch = Watch(60.0)
    made = rerun(folder / "inputs", tmp_path / "made", watch=watch)
    assert made.departure == ""
    assert rows(tmp_path / "made") == seen
    assert list(watch.variables) == NAMES


def test_the_page_shows_them_as_signals(recorded: tuple[Path, list, int]) -> None:
    folder, seen, _ = recorded
    with open_bag(folder / "bag") as bag:
        recording = PageRecording(bag, Detail())
        assert recording.head()["signals"] == [*bag.line.signal_names, *NAMES]
        assert recording.block(0)
        collector = Collector(bag, 0, {"signals": 1}, NAMES)
        for topic, _, raw in bag.raw({"signals", "variables"}):
            collector.add(topic, bag.tick(topic, raw), raw)
    shown = {tick: row[-len(NAMES) :] for tick, row in collector.content.signals}
    known = dict(seen)
    for tick, row in shown.items():
        np.testing.assert_array_equal(row, known.get(tick, [np.nan] * len(NAMES)))


def test_patterns_choose_variables(tmp_path: Path) -> None:
    (tmp_path / "p.st").write_text(
        "VAR_GLOBAL g : INT; END_VAR PROGRAM p VAR a, B : INT; v : ARRAY [1..12] OF INT; END_VAR ; END_PROGRAM"
    )

    def chosen(*record: str) -> list[str]:
        return [
            name.removeprefix("plc/")
            for name in RecordedVariables(StructuredText(tmp_path / "p.st", record=record)).names
        ]

    assert chosen() == []
    assert chosen("p/b", "g") == ["g", "p/b"]
    assert chosen("p/v[1]", "P/?") == ["p/a", "p/b", "p/v[1]"]
    assert chosen("p/v[1?]") == ["p/v[10]", "p/v[11]", "p/v[12]"]
    assert len(chosen("*")) == 15
    two = together(StructuredText(tmp_path / "p.st", record="p/a"), StructuredText(PROGRAMS / "table.st", record="*"))
    assert "plc/p/a" in RecordedVariables(two).names and "plc/table/held" in RecordedVariables(two).names
    with pytest.raises(ControlError, match=stating("'p/w'", "no variable", "pattern", "plc/g", "plc/p/a")):
        chosen("p/w")
    (tmp_path / "p.st").write_text("PROGRAM p VAR v : ARRAY [1..1001] OF INT; END_VAR ; END_PROGRAM")
    with pytest.raises(ControlError, match=stating("1001 variables", "at most", "1000")):
        chosen("*")
    assert len(chosen("p/v[?]")) == 9


def command(*words: object) -> tuple[int, str]:
    done = CliRunner().invoke(main, [str(word) for word in words])
    return done.exit_code, done.output


def run_table(bag: Path, program: Path, *words: object) -> tuple[int, str]:
    return command("run", TABLE, "--duration", 0.2, "--controller", program, "--out", bag, "--no-pictures", *words)


def test_run_records_variables_and_takes_parameters(tmp_path: Path) -> None:
    code, output = run_table(tmp_path / "bag", PROGRAMS / "table.st", "--record-variables", "table/held")
    assert code == 0, output
    with open_bag(tmp_path / "bag") as bag:
        frames = list(bag.read("variables"))
    assert [frame.tick for frame in frames] == list(range(20))
    assert all(list(frame.data.name) == ["plc/table/held"] for frame in frames)
    (tmp_path / "plain.st").write_text("PROGRAM p VAR speed : LREAL := 0.25; END_VAR ; END_PROGRAM")
    (tmp_path / "given.yaml").write_text("tags: {p/speed: belts/table/cmd_speed}\nrecord: p/*\n")
    for number, given in enumerate(
        ("{tags: {p/speed: belts/table/cmd_speed}, record: [p/*]}", tmp_path / "given.yaml")
    ):
        code, output = run_table(tmp_path / f"{number}", tmp_path / "plain.st", "--parameters", given)
        assert code == 0, output
        with open_bag(tmp_path / f"{number}") as bag:
            assert [frame.data.value.tolist() for frame in bag.read("variables")] == [[0.25]] * 20
            given_speed = [one.data.values for one in bag.outcomes()]
        assert given_speed == [(0.25,)] * 20


@pytest.mark.parametrize(
    ("program", "words", "said"),
    [
        ("x : INT;", ("--parameters", "{tags: {p/x: belts/none/speed}}"), "found belts/none/speed, expected one of"),
        ("x : INT;", ("--parameters", "{tags: [1]}"), "tags: [1] given, expected tags (a mapping from variables to"),
        ("x : INT;", ("--parameters", "{speed: 1}"), "speed: 1 given, expected tags (a mapping from variables to"),
        ("x : INT;", ("--parameters", "5"), "--parameters: '5' given, expected a mapping in YAML"),
        ("x : INT;", ("--parameters", "{a: [}"), "--parameters:1: not valid YAML"),
        ("x : INT;", ("--parameters", "nowhere.yaml"), "--parameters: nowhere.yaml: no such file"),
        (
            "x : INT;",
            ("--record-variables", "p/y"),
            "found 'p/y', which fits no variable, expected a pattern of plc/p/x",
        ),
        ("{tag: zones/x} x : INT;", (), "found zones/x, expected a tag of this line, which has no zones/"),
        ("{tag: belts/table/bottles} x : INT(1..2);", (), "belts/table/bottles: found 0, expected"),
    ],
)
def test_what_can_not_begin_leaves_no_recording(
    tmp_path: Path, program: str, words: tuple[str, ...], said: str
) -> None:
    (tmp_path / "p.st").write_text(f"PROGRAM p VAR {program} END_VAR ; END_PROGRAM")
    code, output = run_table(tmp_path / "bag", tmp_path / "p.st", *words)
    assert (code, "Traceback" in output) == (1, False)
    assert said in output.replace("\n", " ")
    assert not (tmp_path / "bag").exists()


def test_parameters_without_a_controller_are_refused() -> None:
    for words in (("--parameters", "{a: 1}"), ("--record-variables", "a")):
        code, output = command("run", "two_bottles", "--no-record", *words)
        assert code == 1
        assert missing(output, [words[0], "without --controller", "both or neither"]) == []


def test_a_python_controller_takes_parameters_and_shows_variables(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "class Mine:\n    def __init__(self, speed: float):\n        self.variables = {'mine/Speed': speed / 2}\n"
        "    def scan(self, inputs):\n        return {'belts/table/cmd_speed': self.variables['mine/Speed']}\n"
    )
    mine, asked = f"{tmp_path / 'mine.py'}:Mine", ("--record-variables", "mine/speed")
    code, output = run_table(tmp_path / "bag", mine, "--parameters", "{speed: 0.5}", *asked)
    assert code == 0, output
    with open_bag(tmp_path / "bag") as bag:
        assert {(*frame.data.name, *frame.data.value.tolist()) for frame in bag.read("variables")} == {
            ("mine/Speed", 0.25)
        }
    code, output = run_table(tmp_path / "other", mine, "--parameters", "{speed: fast}")
    assert code == 1
    assert missing(output, ["unsupported operand", "parameters", "{'speed': 'fast'}"]) == []


def test_what_is_forced_is_part_of_a_snapshot(tmp_path: Path) -> None:
    (tmp_path / "p.st").write_text("PROGRAM p VAR n : INT; s : STRING; END_VAR n := n + 1; END_PROGRAM")
    plc = StructuredText(tmp_path / "p.st")
    plc.force("P/n", 7)
    kept = json.loads(json.dumps(plc.snapshot()))
    other = StructuredText(tmp_path / "p.st")
    other.force("p/n", 3)
    other.restore(kept)
    assert other.snapshot() == kept
    other.unforce("plc/p/N")
    assert other.snapshot()["forced"] == {}
    del kept["forced"]  # as older checkpoints are
    other.restore(kept)
    assert other.snapshot()["forced"] == {}
    with pytest.raises(ControlError, match=stating("p/s", "STRING", "number")):
        plc.force("p/s", 1)
    with pytest.raises(ControlError, match=stating("p/n", "40000", "INT", "-32768 to 32767")):
        plc.force("p/n", 40000)
    with pytest.raises(ControlError, match="p/n: cannot convert float NaN"):
        plc.force("p/n", float("nan"))
