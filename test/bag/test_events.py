# SPDX-License-Identifier: Apache-2.0
"""Events of a line are recorded, read back, and replayed to the same events."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag.editing import edited
from bag.small_line import SMALL_LINE
from rosbags.highlevel import AnyReader

from conveyor_sim.bag.messages.topics import OUTPUTS
from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.bag.replay import replay
from conveyor_sim.columns.events import Event, event_columns
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

SPEED = "belts/straight/cmd_speed"
GIVEN = {
    3: [((SPEED, "alarms/table full"), (0.3, 1.0))],
    12: [(("alarms/table full", "alarms/jam — at exit"), (1.0, 1.0))],
    20: [((SPEED, "alarms/table full"), (math.nan, 0.0))],
}
"""By tick; the last command is refused."""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[tuple[int, tuple[Event, ...], int]]]:
    """A recording with limits, commands and alarms; and what happened, by tick, with the events so far."""
    folder = tmp_path_factory.mktemp("events") / "bag"
    # A ledger for the kernels of test_replay.py.
    sim = Simulation(load_scene(SMALL_LINE, {"limits": {"impact_speed": 0.2}, "effects": {"energy_ledger": "on"}}))
    seen = []
    with Recorder(folder) as recorder:
        outputs = OutputWriter(sim, [recorder], run_id="run")
        outputs.start()
        while sim.tick < 100:
            for names, values in GIVEN.get(sim.tick, []):
                sim.command(names, values, "controller")
            sim.advance()
            outputs.after_tick()
            if sim.line.happened:
                seen.append((sim.tick, tuple(sim.line.happened), sim.line.happened_so_far))
    return folder, seen


def test_what_happened_is_read_back(run: tuple[Path, Any]) -> None:
    folder, seen = run
    with open_bag(folder) as bag:
        frames = list(bag.read("events"))
    assert [frame.tick for frame in frames] == [tick for tick, _, _ in seen]
    for frame, (_, events, total) in zip(frames, seen, strict=True):
        live = event_columns(events, total)
        for name in vars(live):
            np.testing.assert_array_equal(getattr(frame.data, name), getattr(live, name), err_msg=name)
    kinds = {kind for frame in frames for kind in frame.data.kind}
    assert kinds >= {"bottle_fed", "alarm_raised", "alarm_cleared", "command_refused", "machine_state", "limit_passed"}


def test_another_library_reads_them_from_the_bag_alone(run: tuple[Path, Any]) -> None:
    found = []
    with AnyReader([run[0]]) as reader:
        for connection, log_time, data in reader.messages([c for c in reader.connections if c.topic == "/events"]):
            message: Any = reader.deserialize(data, connection.msgtype)
            assert log_time == message.tick * 10_000_000
            found += [n for k, n in zip(message.kind, message.name, strict=True) if k.startswith("alarm")]
    said = [name for name in found if name.split("/")[1] not in ("belts", "limits")]
    assert said == ["alarms/table full", "alarms/jam — at exit", "alarms/table full"]
    assert found[-1] == "alarms/belts/straight/watchdog"  # no more commands come


def test_alarms_and_events_are_replayed_bit_for_bit(run: tuple[Path, Any]) -> None:
    folder, seen = run
    report = replay(folder)
    assert report.exact
    assert report.difference is None
    assert report.compared["events"] == len(seen)


@pytest.mark.parametrize(
    ("field", "change", "part"),
    [
        ("name", lambda message: message.name.__setitem__(0, "alarms/other"), "alarm_raised of alarms/table full"),
        ("at", lambda message: setattr(message, "at", message.at + np.uint64(1)), "alarm_raised of alarms/table full"),
        ("kind", lambda message: message.kind.__setitem__(0, "alarm_cleared"), "alarm_raised of alarms/table full"),
    ],
)
def test_an_event_that_differs_is_found(
    run: tuple[Path, Any], tmp_path: Path, field: str, change: Callable[[Any], object], part: str
) -> None:
    def edit(topic: str, message: Any) -> None:
        if topic == "events" and message.tick == 4:
            change(message)

    difference = replay(edited(run[0], tmp_path / "changed", edit)).difference
    assert difference is not None
    assert (difference.tick, difference.topic, difference.field, difference.part) == (4, "events", field, part)


def test_an_event_that_the_recording_lacks_is_found(run: tuple[Path, Any], tmp_path: Path) -> None:
    """By the number of events so far, which the next message states."""

    def edit(topic: str, message: Any) -> None:
        if topic == "events" and message.tick > 4:
            message.total -= 1

    difference = replay(edited(run[0], tmp_path / "changed", edit)).difference
    assert difference is not None
    assert (difference.topic, difference.field) == ("events", "total")


def test_an_event_that_does_not_happen_again_is_found(run: tuple[Path, Any], tmp_path: Path) -> None:
    """The event belongs to a command whose outcome claims that it never reached the line, so it is not replayed."""

    def edit(topic: str, message: Any) -> None:
        if topic == "outcomes" and message.tick == 3:
            message.source = "arrival"

    with open_bag(run[0]) as bag, Recorder(tmp_path / "events", topics=["line", "outcomes", "events"]) as recorder:
        for topic, log_time, data in bag.raw({"line", "outcomes", "events"}):
            recorder.write(topic, data, log_time)
    difference = replay(edited(tmp_path / "events", tmp_path / "changed", edit)).difference
    assert difference is not None
    assert str(difference).endswith("topic events: the number of messages was recorded as 1 and replayed as 0")


def test_a_recording_without_events_is_replayed_as_before(run: tuple[Path, Any], tmp_path: Path) -> None:
    with open_bag(run[0]) as bag, Recorder(tmp_path / "old", topics=[t for t in OUTPUTS if t != "events"]) as recorder:
        for topic, log_time, data in bag.raw():
            if topic != "events":
                recorder.write(topic, data, log_time)
    report = replay(tmp_path / "old")
    assert report.difference is None
    assert "events" not in report.compared
