# SPDX-License-Identifier: Apache-2.0
"""Times of PackML's Admin: shapes, units, and values that follow simulated time, as node-opcua reads them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from conveyor_sim.columns.events import Event
from conveyor_sim.line.machines.packml import PackMLState
from conveyor_sim.line.run_state import REPLAYING, RUNNING, RunState
from conveyor_sim.protocols.opcua.packml_times import MODE_COUNT, STATE_COUNT, LineNews, StateTimes
from conveyor_sim.protocols.tags.tag_provider import LineSnapshot
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation
from test.protocols.opcua.conftest import SCENE
from test.protocols.opcua.node_session import NodeSession, needs_node_opcua, node_session

if TYPE_CHECKING:
    from pathlib import Path

    from test.protocols.opcua.conftest import Line

MACHINE = "machines/filler"
ADMIN = f"{MACHINE}/PackML.Admin"
PRODUCTION, MANUAL = 1, 3
EXECUTE, STOPPED = int(PackMLState.EXECUTE), int(PackMLState.STOPPED)


def read_times(session: NodeSession) -> dict[str, Any]:
    """Return the times that are not 0, by their indices, and the time since the reset."""
    times: dict[str, Any] = {}
    for name in ("ModeCurrentTime", "ModeCumulativeTime"):
        answer = session.read(f"{ADMIN}.{name}")
        assert (answer["type"], len(answer["value"]), answer["status"]) == ("Int32", MODE_COUNT, "Good")
        times[name] = {place: value for place, value in enumerate(answer["value"]) if value}
    for name in ("StateCurrentTime", "StateCumulativeTime"):
        answer = session.read(f"{ADMIN}.{name}")
        assert (answer["type"], answer["dimensions"]) == ("Int32", [MODE_COUNT, STATE_COUNT])
        assert len(answer["value"]) == MODE_COUNT * STATE_COUNT
        times[name] = {divmod(place, STATE_COUNT): value for place, value in enumerate(answer["value"]) if value}
    times["AccTimeSinceReset"] = session.read(f"{ADMIN}.AccTimeSinceReset")["value"]
    return times


@needs_node_opcua
def test_times_by_mode_and_state_follow_simulated_time(line: Line, tmp_path: Path) -> None:
    line.client()
    with node_session(line.server.address, tmp_path, "operator") as session:
        for name, rank in (("StateCurrentTime", 2), ("ModeCurrentTime", 1), ("AccTimeSinceReset", -1)):
            assert session.read(f"{ADMIN}.{name}", "ValueRank")["value"] == rank
        assert session.read(f"{ADMIN}.StateCumulativeTime", "ArrayDimensions")["value"] == [MODE_COUNT, STATE_COUNT]
        line.advance(250)  # 2.5 s
        assert read_times(session) == {
            "ModeCurrentTime": {PRODUCTION: 2},
            "ModeCumulativeTime": {PRODUCTION: 2},
            "StateCurrentTime": {(PRODUCTION, EXECUTE): 2},
            "StateCumulativeTime": {(PRODUCTION, EXECUTE): 2},
            "AccTimeSinceReset": 2,
        }
        session.write(f"{MACHINE}/cntrl_cmd", "UInt32", 3)  # Stop
        line.advance(151)
        session.write(f"{MACHINE}/mode", "UInt32", MANUAL)
        line.advance(120)
        assert line.read(f"{MACHINE}/state") == STOPPED and line.read(f"{MACHINE}/mode") == MANUAL
        assert read_times(session) == {
            "ModeCurrentTime": {MANUAL: 1},
            "ModeCumulativeTime": {PRODUCTION: 4, MANUAL: 1},
            "StateCurrentTime": {(MANUAL, STOPPED): 1},
            "StateCumulativeTime": {(PRODUCTION, EXECUTE): 2, (PRODUCTION, STOPPED): 1, (MANUAL, STOPPED): 1},
            "AccTimeSinceReset": 5,
        }
        line.begin(Simulation(load_scene(SCENE), threads=1))
        line.advance()
        times = read_times(session)
        assert times.pop("AccTimeSinceReset") == 0 and not any(times.values())


@needs_node_opcua
def test_packml_objects_contains_each_machine(line: Line, tmp_path: Path) -> None:
    with node_session(line.server.address, tmp_path) as session:
        (objects,) = [each for each in session.ask("browse", node="i=85") if each["name"] == "PackMLObjects"]
        members = session.ask("browse", node=objects["node"])
        assert {each["node"] for each in members} == {f"ns=2;s=machines/{name}/PackML" for name in ("filler", "packer")}
        assert sorted(each["shown"] for each in members) == ["PackML of filler", "PackML of packer"]
        assert {(each["name"], each["reference"]) for each in members} == {("PackML", "ns=0;i=35")}
        assert {each["type"] for each in members} == {objects["node"].replace("i=72", "i=6")}


def tracker() -> StateTimes:
    simulation = Simulation(load_scene(SCENE), threads=1)
    return StateTimes(MACHINE, {tag.name: tag for tag in simulation.process_image.tags}, 0.01)


def snapshot(tick: int, state: int = EXECUTE, run: int = RUNNING) -> LineSnapshot:
    return LineSnapshot(tick, {f"{MACHINE}/state": state, f"{MACHINE}/mode": 1.0}, run=RunState(run))


def event(at: int, state: int) -> Event:
    return Event(at, "machine_state", f"{MACHINE}/state", -1, float(state), "")


def sums(times: StateTimes, shown: LineSnapshot, *events: Event, **news: bool) -> tuple[dict[int, int], int]:
    """Return the cumulative times of Production by state, without zeros, and the time since the reset."""
    values = times.values(shown, LineNews(events, **news))
    row = values["StateCumulativeTime"].Value[PRODUCTION]
    return {state: value for state, value in enumerate(row) if value}, values["AccTimeSinceReset"].Value


def test_changes_between_two_frames_have_their_ticks() -> None:
    times = tracker()
    assert sums(times, snapshot(100)) == ({EXECUTE: 1}, 1)
    there, back = event(200, STOPPED), event(900, EXECUTE)
    assert sums(times, snapshot(1000), there, back) == ({EXECUTE: 3, STOPPED: 7}, 10)


def test_an_event_waits_for_its_tick() -> None:
    times = tracker()
    assert sums(times, snapshot(100), event(200, STOPPED)) == ({EXECUTE: 1}, 1)
    assert sums(times, snapshot(300, STOPPED)) == ({EXECUTE: 2, STOPPED: 1}, 3)


@pytest.mark.parametrize("news", [{"is_incomplete": True}, {"is_new_run": True}])
def test_times_begin_again(news: dict[str, bool]) -> None:
    times = tracker()
    sums(times, snapshot(5000))
    began = 0 if "is_new_run" in news else 4
    assert sums(times, snapshot(400), **news)[1] == 4 - began
    assert sums(times, snapshot(600)) == ({EXECUTE: 6 - began}, 6 - began)


def test_a_jump_of_a_playback_is_no_time() -> None:
    times = tracker()
    sums(times, snapshot(100, run=REPLAYING))
    assert sums(times, snapshot(500, run=REPLAYING))[1] == 5
    assert sums(times, snapshot(90_000, run=REPLAYING)) == ({}, 0)


def test_a_state_that_packml_lacks_changes_nothing() -> None:
    times = tracker()
    odd = replace(snapshot(300), values={f"{MACHINE}/state": 99.0, f"{MACHINE}/mode": 7.0})
    assert sums(times, odd, event(100, -5)) == ({EXECUTE: 3}, 3)
