# SPDX-License-Identifier: Apache-2.0
"""A scene in a separate process as a tag provider: snapshots, requests, and its end."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import pytest
from facts import missing
from protocols.waiting import until
from scenes import MASS, NO_FLOOR, RADIUS, bottle, contact, segment
from scenes import scene as bottle_scene

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import INJECT, MODE, OPERATE, OWN, SET, Input
from conveyor_sim.line.line import image_of
from conveyor_sim.line.run_state import ENDED, LOCKSTEP, PAUSED, RUNNING, STOPPED
from conveyor_sim.protocols.hosting.frames import MOST_FRAMES, Frames
from conveyor_sim.protocols.hosting.server_messages import ServerTask
from conveyor_sim.protocols.hosting.server_process import ParentCalls, RemoteTagProvider
from conveyor_sim.protocols.hosting.settings import ServerSettings
from conveyor_sim.protocols.tags.line_mirror import decoded
from conveyor_sim.protocols.tags.scene_messages import SceneTask
from conveyor_sim.protocols.tags.scene_provider import SceneTagProvider
from conveyor_sim.protocols.tags.tag_provider import MOST_WAITING, LineSnapshot
from conveyor_sim.scene import Scene, load_scene

SPEED, SETPOINT = "belts/zone1/speed", "belts/zone1/cmd_speed"


def zoned(**overrides: Any) -> Scene:
    return load_scene("config/scenarios/zoned_line.yaml", {"duration": 1000.0, **overrides})


class Served:
    """Providers that end with their test."""

    def __init__(self) -> None:
        self.sources: list[SceneTagProvider] = []
        self.said: list[str] = []

    def __call__(
        self, scene: Scene | None = None, record: Path | None = None, factor: float = 1.0, lockstep: bool = False
    ) -> SceneTagProvider:
        source = SceneTagProvider(
            SceneTask(scene or zoned(), record, 0, factor, 1, lockstep=lockstep), self.said.append
        )
        self.sources.append(source)
        source.wait_for_line()
        return source


@pytest.fixture
def served() -> Iterator[Served]:
    made = Served()
    yield made
    for source in made.sources:
        source.close()


@pytest.fixture(scope="module")
def kept() -> Iterator[SceneTagProvider]:
    """Return the shared providers, for tests that need no separate process."""
    with SceneTagProvider(SceneTask(zoned(), None, 0, 1.0, 1), lambda sentence: None) as source:
        source.wait_for_line()
        yield source


@pytest.fixture
def running(kept: SceneTagProvider) -> SceneTagProvider:
    """Return the shared provider at the start of its run."""
    run = kept.snapshot.run_id
    assert kept.control("reset", 0, "a test") == ""
    until(lambda: kept.snapshot.run_id != run, "the reset")
    assert kept.snapshot.run.state == RUNNING or kept.control("resume", 0, "a test") == ""
    until(lambda: kept.snapshot.run.state == RUNNING, "it runs")
    return kept


def setpoint(value: float, writer: str = "me") -> Input:
    return Input("modbus", writer, "controller", SET, (SETPOINT,), (value,))


def pause(source: SceneTagProvider) -> None:
    assert source.control("pause", 0.0, "a test") == ""
    until(lambda: source.snapshot.run.state == PAUSED, "the pause")


def test_it_is_shown_as_it_is(served: Served) -> None:
    source = served()
    about, scene = source.info, zoned()
    assert (about.name, about.where, about.tick) == (scene.name, scene.where, 0.01)
    assert [tag.name for tag in about.tags] == [tag.name for tag in image_of(scene).tags]
    for told, tag in zip(about.tags, image_of(scene).tags, strict=True):
        assert (told.kind, told.role, told.unit, told.low, told.high) == (
            tag.kind,
            tag.role,
            tag.unit,
            tag.low,
            tag.high,
        )
        assert (told.initial, told.nominal, dict(told.texts)) == (tag.initial, tag.nominal, dict(tag.texts))
        assert (told.description, told.device, told.device_class) == (tag.description, tag.device, tag.device_class)
    until(lambda: source.snapshot.tick > 10, "ticks")
    shown = source.snapshot
    assert shown.run.state == RUNNING and not shown.lost and shown.run_id
    assert shown.values.keys() == {*image_of(scene).signal_names, *image_of(scene).command_names}
    assert shown.values[SPEED] == 0.5
    until(lambda: source.events(0)[0] > 0, "an event")


def test_every_tick_of_a_line_in_real_time_can_be_heard_of(running: SceneTagProvider) -> None:
    source, ticks = running, list[int]()
    end = source.listen(lambda: ticks.append(source.snapshot.tick))
    until(lambda: len(ticks) > 100, "a second of ticks")
    end()
    assert ticks == sorted(ticks)
    assert len(set(ticks)) > 50  # of a busy machine


def mirror(source: SceneTagProvider, pipe: Connection) -> RemoteTagProvider:
    """Return the line as the process of a protocol server mirrors it."""
    task = ServerTask("modbus", 0, ServerSettings(), source.controls, True, False, None, (0, 0))
    return RemoteTagProvider(task, ParentCalls(pipe), decoded, None)


def catch_up(frames: Frames, view: RemoteTagProvider) -> int:
    """Apply all waiting frames and return their number."""
    count = 0
    while (frame := frames.fetch()) is not None and frame.is_new:
        view.apply(frame)
        count += 1
    return count


def test_a_mirror_shows_what_its_source_does(running: SceneTagProvider) -> None:
    frames, (pipe, _) = Frames(running), Pipe()
    view = mirror(running, pipe)
    view.apply(frames.fetch())
    assert view.info == running.info
    assert running.give(setpoint(0.25)) == ""
    until(lambda: running.snapshot.values[SPEED] == 0.25, "the speed")
    pause(running)
    catch_up(frames, view)
    assert view.snapshot.values == running.snapshot.values and view.snapshot.forced == running.snapshot.forced
    assert (view.snapshot.tick, view.snapshot.run, view.snapshot.run_id) == (
        running.snapshot.tick,
        running.snapshot.run,
        running.snapshot.run_id,
    )
    assert view.snapshot.read_back is not None and "me" in view.snapshot.read_back.writers
    assert view.events(0) == running.events(0)
    run = running.snapshot.run_id
    assert running.control("reset", 0.0, "a test") == "" and running.control("resume", 0.0, "a test") == ""
    until(lambda: running.snapshot.run_id != run and running.snapshot.run.state == RUNNING, "the reset")
    catch_up_until(frames, view, lambda: view.snapshot.run_id == running.snapshot.run_id)
    frames.end()
    assert frames.fetch() is None


def catch_up_until(frames: Frames, view: RemoteTagProvider, condition: Callable[[], bool]) -> None:
    def step() -> bool:
        view.apply(frames.fetch())
        return condition()

    until(step, "the mirror")


def test_who_fetches_nothing_misses_ticks_and_fills_no_memory(running: SceneTagProvider) -> None:
    frames, (pipe, _) = Frames(running), Pipe()
    view = mirror(running, pipe)
    frames.counts = False  # a process that starts
    first = running.snapshot.tick
    until(lambda: running.snapshot.tick > first + MOST_FRAMES + 10, "more ticks than wait")
    assert frames.left_out == 0
    frames.counts = True
    until(lambda: frames.left_out > 10, "more ticks than wait")
    pause(running)
    tick = running.snapshot.tick
    assert catch_up(frames, view) == MOST_FRAMES
    assert view.snapshot.tick == tick and view.snapshot.values == running.snapshot.values
    assert view.events(0) == running.events(0), "none of them is missing"
    frames.end()


def test_who_gets_no_answer_is_refused(running: SceneTagProvider) -> None:
    pipe, _unread = Pipe()
    view = mirror(running, pipe)
    assert "gave no answer within 1 s" in view.give(setpoint(0.25))


def test_what_is_given_acts_and_is_on_record_and_replays(served: Served, tmp_path: Path) -> None:
    source = served(record=tmp_path / "bag")
    assert source.give(setpoint(0.25)) == ""
    until(lambda: source.snapshot.values[SPEED] == 0.25, "the speed")
    read_back = source.snapshot.read_back
    assert read_back is not None and "me" in read_back.writers
    assert source.give(Input(OPERATE, "Jo", "operator", MODE, ("belts/zone1",), (3.0,))) == ""
    until(lambda: source.snapshot.values["belts/zone1/mode"] == 3.0, "the mode")
    assert source.give(Input("modbus", "he", "controller", OWN, (), ())) == ""
    until(lambda: source.snapshot.owner == "he", "the owner")
    assert source.give(setpoint(0.3)) == ""  # in other hands
    until(lambda: any(event.kind == "command_refused" for event in source.events(0)[1]), "the refusal")
    assert source.snapshot.values[SETPOINT] == 0.25
    source.close()
    assert source.recordings == [tmp_path / "bag"]
    report = replay(tmp_path / "bag")
    assert report.exact and report.difference is None
    assert report.compared["outcomes"] >= 4


def test_pause_step_resume_reset(served: Served, tmp_path: Path) -> None:
    source = served(record=tmp_path / "bag")
    pause(source)
    tick, run = source.snapshot.tick, source.snapshot.run_id
    assert source.control("step", 3, "a test") == ""
    until(lambda: source.snapshot.tick == tick + 3, "the step")
    assert source.give(setpoint(0.25)) == ""
    assert source.control("step", 1, "a test") == ""
    until(lambda: source.snapshot.values[SETPOINT] == 0.25, "the setpoint")
    assert "expected a whole number" in source.control("step", 0.5, "a test")
    assert source.control("resume", 0, "a test") == ""
    until(lambda: source.snapshot.tick > tick + 20, "ticks")
    assert "expected it to be paused" in source.control("step", 1, "a test")
    assert source.control("reset", 0, "a test") == ""
    until(lambda: source.snapshot.run_id != run, "the reset")
    until(lambda: source.snapshot.run.state == RUNNING, "it goes on")
    assert source.snapshot.values[SETPOINT] == 0.5  # as it begins
    assert "seek" in source.control("seek", 1.0, "a test")
    source.close()
    assert source.recordings == [tmp_path / "bag", tmp_path / "bag_1"]
    assert all(replay(bag).difference is None for bag in source.recordings)


def test_in_lockstep_time_passes_up_to_the_target_with_what_was_written_before_it(
    served: Served, tmp_path: Path
) -> None:
    source = served(zoned(duration=0.1), record=tmp_path / "bag", lockstep=True)
    seen: list[tuple[int, float]] = []
    source.listen(lambda: seen.append((source.snapshot.tick, source.snapshot.values[SETPOINT])))
    assert (source.snapshot.tick, source.snapshot.run.state, source.snapshot.run.reason) == (
        0,
        LOCKSTEP,
        "by handshake",
    )
    assert source.give(setpoint(0.1)) == "" == source.control("target", 4, "a test")
    assert source.give(setpoint(0.2)) == "" == source.control("target", 4, "a test")  # which changes nothing
    until(lambda: source.snapshot.tick == 4, "the target")
    assert source.snapshot.values[SETPOINT] == 0.1
    assert source.control("target", 6, "a test") == "" == source.give(setpoint(0.3))
    assert source.control("target", 9, "a test") == ""  # before the line is at 6
    until(lambda: source.snapshot.tick == 9, "the last target")
    assert {tick for tick, _ in seen} <= {0, 4, 6, 9}
    assert {value for tick, value in seen if tick == 6} <= {0.2}
    assert source.snapshot.values[SETPOINT] == 0.3
    assert "expected at most 10, the end of the run" in source.control("target", 11, "a test")
    assert "expected only run/target_tick" in source.control("pause", 0, "a test")
    assert source.control("target", 10, "a test") == ""
    until(lambda: source.snapshot.run.state == ENDED, "the end")
    assert source.snapshot.tick == 10
    source.close()
    with open_bag(tmp_path / "bag") as bag:
        acted = [(frame.tick, frame.data.values) for frame in bag.outcomes() if frame.data.names == (SETPOINT,)]
    assert acted == [(0, (0.1,)), (4, (0.2,)), (6, (0.3,))]
    assert replay(tmp_path / "bag").difference is None


def test_the_end_of_the_scene_is_shown_and_a_reset_leads_on(served: Served) -> None:
    source = served(zoned(duration=0.5), factor=0.0)
    until(lambda: source.snapshot.run.state == ENDED, "the end")
    assert source.snapshot.tick == 50 and not source.snapshot.lost
    assert missing(source.give(setpoint(0.25)), "ended", "reset") == []
    assert missing(source.control("resume", 0, "a test"), "ended", "reset") == []
    assert missing(source.control("speed", 1.0, "a test"), "ended", "reset") == []
    assert source.control("reset", 0, "a test") == ""
    until(lambda: source.snapshot.run.state == PAUSED and source.snapshot.tick == 0, "the reset")
    assert source.control("resume", 0, "a test") == ""
    until(lambda: source.snapshot.run.state == ENDED, "the end, again")


def test_what_the_guard_stops_is_shown_with_the_reason(served: Served) -> None:
    speed = 1.1 * RADIUS * (1e3 / MASS) ** 0.5
    given = bottle_scene(
        contacts=[contact(1e3, "steel")],
        rails={"stop": segment((0.6, -1.0), (0.6, 1.0))},
        bottles=[bottle(0.6 - RADIUS - 0.055 * speed, 0.0, speed)],
        **NO_FLOOR,
    )
    source = served(given)
    until(lambda: source.snapshot.run.state == STOPPED, "the stop")
    assert source.snapshot.run.reason.startswith("bottle 0 sinks ") and not source.snapshot.lost
    assert missing(source.give(setpoint(0.1)), "stopped", "reset") == []
    assert source.control("reset", 0, "a test") == ""
    until(lambda: source.snapshot.run.state == PAUSED, "the reset")


def test_what_waits_while_it_is_paused_is_bounded(running: SceneTagProvider) -> None:
    source = running
    pause(source)
    refused = [source.give(setpoint(0.1 + 0.1 * (number % 2))) for number in range(MOST_WAITING + 100)]
    assert [bool(reason) for reason in refused] == [False] * MOST_WAITING + [True] * 100
    assert missing(refused[-1], "1000 inputs", "next tick") == []
    assert source.control("step", 1, "a test") == ""
    until(lambda: source.snapshot.values[SETPOINT] == 0.2, "the last of them")
    until(lambda: source.give(setpoint(0.3)) == "", "room again")


def test_a_process_that_is_killed_is_told_of_and_followed_by_another(served: Served, tmp_path: Path) -> None:
    source = served(record=tmp_path / "bag")
    until(lambda: source.snapshot.tick > 20, "ticks")
    run, seen = source.snapshot.run_id, list[LineSnapshot]()
    source.listen(lambda: seen.append(source.snapshot))
    os.kill(source.pid, signal.SIGKILL)
    until(lambda: any(shown.lost for shown in seen), "its loss")
    assert "the process that simulates zoned_line was killed by signal 9" in [shown.lost for shown in seen]
    until(lambda: any(shown.run_id != run and not shown.lost for shown in seen), "another one")
    assert next(shown.tick for shown in seen if shown.run_id != run) < 20
    assert any("is restarted" in sentence for sentence in served.said)
    source.close()
    assert source.recordings == [tmp_path / "bag", tmp_path / "bag_1"]
    assert replay(tmp_path / "bag_1").difference is None


def test_a_process_that_hangs_is_stale_until_it_goes_on(running: SceneTagProvider) -> None:
    source = running
    until(lambda: source.snapshot.tick > 5, "ticks")
    os.kill(source.pid, signal.SIGSTOP)
    try:
        until(lambda: source.snapshot.lost, "silence")
        assert missing(source.snapshot.lost, "no message", "5 s") == []
        assert source.give(setpoint(0.1)) == source.snapshot.lost == source.control("pause", 0, "a test")
    finally:
        os.kill(source.pid, signal.SIGCONT)
    until(lambda: not source.snapshot.lost, "a sign of life")


def test_a_scene_that_can_not_be_recorded_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    source = SceneTagProvider(SceneTask(zoned(), tmp_path / "file", 0, 1.0, 1), lambda sentence: None)
    with pytest.raises(ConveyorError, match="a file is in its place"):
        source.wait_for_line()
    source.close()
    assert source.give(setpoint(0.1)) != ""


def test_faults_are_not_for_clients(running: SceneTagProvider) -> None:
    source, before = running, running.events(0)[0]
    assert source.give(Input("opcua", "Jo", "operator", INJECT, ("machines/filler/stop",), (1.0,))) == ""
    until(lambda: any(event.kind == "command_refused" for event in source.events(before)[1]), "the refusal")
