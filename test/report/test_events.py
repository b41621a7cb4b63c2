# SPDX-License-Identifier: Apache-2.0
"""`conveyor-sim events`: what happened in a recording, chosen, as a table and as CSV."""

import csv
import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from bag.small_line import SMALL_LINE
from click.testing import CliRunner, Result
from facts import missing

from conveyor_sim.bag.mcap.writer import McapFileWriter, Schema
from conveyor_sim.bag.messages.encode import Header, bool_message
from conveyor_sim.bag.messages.topics import OUTPUTS
from conveyor_sim.bag.messages.typestore import definition
from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.cli import main
from conveyor_sim.report.events import KINDS, EventRow, event_listing, folded
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

Events = Callable[..., Result]


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small line with an alarm that comes at tick 10 and goes at tick 50, and a command that is refused at 20."""
    folder = tmp_path_factory.mktemp("events") / "bag"
    sim = Simulation(load_scene(SMALL_LINE))
    given = {10: ("alarms/table full", 1.0), 20: ("belts/no\nwhere", 1.0), 50: ("alarms/table full", 0.0)}
    with Recorder(folder) as recorder:
        outputs = OutputWriter(sim, [recorder], run_id="run")
        outputs.start()
        while sim.tick < 100:
            if sim.tick in given:
                name, value = given[sim.tick]
                sim.command((name,), (value,))
            sim.advance()
            outputs.after_tick()
    return folder


@pytest.fixture
def events(bag: Path) -> Events:
    """The command for that bag."""
    return lambda *arguments: CliRunner().invoke(
        main, ["events", str(bag), *map(str, arguments)], env={"COLUMNS": "200"}, catch_exceptions=False
    )


def lines(result: Result) -> list[list[str]]:
    """Rows of the table, by words."""
    assert result.exit_code == 0, result.output
    return [line.split() for line in result.output.splitlines() if re.match(r" *\d", line)]


def test_all_of_them_are_printed_in_order(events: Events, bag: Path) -> None:
    rows = lines(events("--all"))
    with open_bag(bag) as opened:
        kinds = [kind for frame in opened.read("events") for kind in frame.data.kind]
    assert [row[1] for row in rows] == kinds
    assert [float(row[0]) for row in rows] == sorted(float(row[0]) for row in rows)


def test_they_are_chosen_by_kind(events: Events) -> None:
    raised = [["0.100", "alarm_raised"], ["0.400", "alarm_raised"]]  # the second by a watchdog
    assert [row[:2] for row in lines(events("--kind", "alarm_raised"))] == raised
    both = lines(events("--kind", "alarm_*", "--kind", "command_refused"))
    assert [row[:2] for row in both] == [
        ["0.100", "alarm_raised"],
        ["0.200", "command_refused"],
        ["0.400", "alarm_raised"],
        ["0.500", "alarm_cleared"],
    ]


def test_they_are_chosen_by_name(events: Events) -> None:
    assert {row[2] for row in lines(events("--name", "infeeds/*"))} == {"infeeds/supply"}
    chosen = lines(events("--name", "alarms/*", "--name", "belts/no*"))
    assert [row[0] for row in chosen] == ["0.100", "0.200", "0.400", "0.500"]


def test_they_are_chosen_by_time(events: Events) -> None:
    everything = [row[0] for row in lines(events("--all"))]
    assert [row[0] for row in lines(events("--all", "--from", 0.2, "--to", 0.5))] == [
        time for time in everything if 0.2 <= float(time) <= 0.5
    ]
    assert "0.200" in everything and "0.500" in everything


def test_json_has_all_columns(events: Events, tmp_path: Path) -> None:
    rows = json.loads(events("--json").stdout)
    events("--csv", tmp_path / "events.csv")
    with (tmp_path / "events.csv").open(newline="", encoding="utf-8") as stream:
        assert [{name: str(value) if value is not None else "" for name, value in row.items()} for row in rows] == [
            *csv.DictReader(stream)
        ]
    assert json.loads(events("--json", "--kind", "limit_passed").stdout) == []


def test_equal_events_are_folded_between_others() -> None:
    """A machine that starves in each cycle, and a fault in between."""
    cycle = [("starved", 1.0), ("starved", 0.0)]
    rows = [
        EventRow(float(time), time, "machine_state", "machines/packer/starved", None, cycle[time % 2][1], "")
        for time in range(1000)
    ]
    rows.insert(500, EventRow(499.5, 499, "fault_injected", "belts/line/trip", None, 1.0, ""))
    told = [(fold.first.time, fold.first.value, fold.count, fold.last) for fold in folded(rows)]
    assert told == [
        (0.0, 1.0, 250, 498.0), (1.0, 0.0, 250, 499.0), (499.5, 1.0, 1, 0.0),
        (500.0, 1.0, 250, 998.0), (501.0, 0.0, 250, 999.0),
    ]  # fmt: skip
    lines = event_listing(rows, None)
    assert len(lines) == 6
    assert missing(lines[1], ["machines/packer/starved", "250 times", "498.000 s"]) == []
    assert len(event_listing(rows, None, every=True)) == 1002
    bottles = [EventRow(float(n), n, "bottle_fed", "infeeds/in", n, float(n), "") for n in range(4)]
    assert missing(event_listing(bottles, None)[1], ["4 bottles", "3.000 s"]) == []
    assert len(folded(bottles[:2])) == 2


@pytest.mark.parametrize("width", [40, 80, 120])
def test_names_are_whole_in_any_width(width: int) -> None:
    names = [f"machines/a_filler_with_a_long_name_{n}/stop_reason" for n in range(2)]
    rows = [EventRow(float(n), n, "machine_state", name, None, 1.0, "no bottles") for n, name in enumerate(names)]
    text = "\n".join(event_listing(rows, width))
    assert missing(text, *names, "machine_state") == []
    assert all(len(line) <= width or " " not in line.strip() for line in text.splitlines())


def test_csv_has_all_columns_and_no_control_characters(events: Events, tmp_path: Path) -> None:
    result = events("--to", 0.5, "--csv", tmp_path / "events.csv")
    with (tmp_path / "events.csv").open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert f"{len(rows)} events written to" in result.output
    raised = next(row for row in rows if row["kind"] == "alarm_raised")
    assert raised == {
        "time": "0.1",
        "tick": "10",
        "kind": "alarm_raised",
        "name": r"alarms/table full",
        "bottle": "",
        "value": "1.0",
        "text": "",
    }
    assert r"belts/no\nwhere" in (tmp_path / "events.csv").read_text()
    fed = next(row for row in rows if row["kind"] == "bottle_fed")
    assert (fed["name"], fed["bottle"], fed["value"]) == ("infeeds/supply", "7", "1.0")


@pytest.mark.parametrize("file", ["bag_0.mcap", "metadata.yaml"])
def test_csv_does_not_take_the_place_of_the_recording(bag: Path, events: Events, file: str) -> None:
    held = (bag / file).read_bytes()
    for path in (bag / file, bag / ".." / "bag" / file):
        result = events("--csv", path)
        assert (result.exit_code, result.output.count("\n")) == (1, 1)
        assert "which is a file of the recording" in result.output
    single = CliRunner().invoke(main, ["events", str(bag / "bag_0.mcap"), "--csv", str(bag / "bag_0.mcap")])
    assert single.exit_code == 1
    assert (bag / file).read_bytes() == held


def test_what_never_happened_is_said(events: Events) -> None:
    result = events("--kind", "limit_passed")
    assert (result.exit_code, result.output.count("\n")) == (0, 1)
    assert "no such event" in result.output


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--kind", "alarm"], f"--kind: alarm given, expected one of {', '.join(KINDS)}"),
        (["--from", "5", "--to", "3"], "--from and --to: 5 and 3 given, expected two times in s, in this order"),
        (["--from", "nan"], "--from and --to: nan and inf given"),
        (["--csv", "/nowhere/events.csv"], "/nowhere/events.csv: can't be written (No such file or directory)"),
    ],
)
def test_errors_are_one_sentence(events: Events, arguments: list[str], words: str) -> None:
    result = events(*arguments)
    assert result.exit_code == 1
    assert words in result.output
    assert len(result.output.strip().splitlines()) == 1


def test_an_older_or_damaged_bag_is_refused_in_one_sentence(bag: Path, tmp_path: Path) -> None:
    with open_bag(bag) as opened, Recorder(tmp_path / "old", topics=[t for t in OUTPUTS if t != "events"]) as recorder:
        for topic, log_time, data in opened.raw():
            if topic != "events":
                recorder.write(topic, data, log_time)
    with (tmp_path / "other.mcap").open("wb") as stream, open_bag(bag) as opened:
        file = McapFileWriter(stream, "other.mcap", "jazzy")
        for topic, kind in (("line", OUTPUTS["line"].type), ("events", "std_msgs/msg/Bool")):
            channel = file.add_topic(f"/{topic}", Schema(kind, "ros2msg", definition(kind).encode()), "cdr", {})
            data = bool_message(True, Header(0, 1, "")) if topic == "events" else next(opened.raw({"line"}))[2]
            file.add_message(channel, data, 1, 1)
        file.finish()
    (tmp_path / "cut.mcap").write_bytes((bag / "bag_0.mcap").read_bytes()[:9000])
    for path, words in (
        (tmp_path / "old", "holds no topic events, expected a recording with it"),
        (tmp_path / "cut.mcap", "is damaged"),
        (tmp_path / "gone", "no such bag"),
        (tmp_path / "other.mcap", "its topic events is of type std_msgs/msg/Bool, expected conveyor_msgs/msg/Events"),
    ):
        result = CliRunner().invoke(main, ["events", str(path)])
        assert result.exit_code == 1
        assert words in result.output
        assert len(result.output.strip().splitlines()) == 1
