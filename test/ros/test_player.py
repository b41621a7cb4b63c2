# SPDX-License-Identifier: Apache-2.0
"""Messages of a played recording, collected in a list: order, rate, pause, seek, and the commands in it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from bag.small_line import SPEED, TURN
from ros.recording import EYE, MADE, TICKS, record

from conveyor_sim.bag.mcap.writer import McapFileWriter, Schema
from conveyor_sim.bag.messages import encode as types
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.messages.typestore import definition, typestore
from conveyor_sim.bag.reader import Bag, open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.errors import BagError
from conveyor_sim.run.lockstep import Refused
from conveyor_sim.run.playback import Playback, PlayedMessage, Player


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[bytes]]:
    """The recording, and what the live line told of its photo-eye."""
    folder = tmp_path_factory.mktemp("bags") / "short"
    return folder, record(folder)


@pytest.fixture(scope="module")
def bag(live: tuple[Path, list[bytes]]) -> Iterator[Bag]:
    with open_bag(live[0]) as opened:
        yield opened


class Played:
    """A player with what it has published and the times it has told; `now` is the wall time it is given."""

    def __init__(self, bag: Bag, rate: float, *, start: float | None = None, paused: bool = False) -> None:
        self.messages: list[PlayedMessage] = []
        self.clock: list[int] = []
        self.now = 100.0
        self.player = Player(
            Playback(bag),
            rate,
            start=start,
            paused=paused,
            publish=self.messages.append,
            beat=lambda stamp_ns, now: self.clock.append(stamp_ns),
        )

    def pass_time(self, seconds: float) -> None:
        """Steps when the player asks for it, until so much wall time has passed."""
        end = self.now + seconds
        while self.now < end and not self.player.ended:
            self.now = min(end, self.now + self.player.step(self.now))

    def take(self) -> list[PlayedMessage]:
        """Return the messages published since the last call."""
        taken, self.messages[:] = list(self.messages), []
        return taken


def recorded(bag: Bag, after_tick: int = -1) -> list[PlayedMessage]:
    """The recorded messages of later ticks, without the latched ones."""
    after_ns = max(1, after_tick * 10_000_000) if after_tick >= 0 else 0
    return [PlayedMessage(topic, data) for topic, stamp, data in bag.raw() if stamp > after_ns and topic not in LATCHED]


CHANGING = {"readback", "alarm_states"}
"""Latched, and sent again whenever it is another."""

LATCHED = {"line", "plant", "run_state", *CHANGING}


def write(bag: Bag, folder: Path, messages: list[tuple[str, int]]) -> Path:
    """A recording of some messages: the first of each topic in `bag`, at times in s."""
    first: dict[str, bytes] = {}
    for topic, _, data in bag.raw():
        first.setdefault(topic, data)
    with Recorder(folder) as recorder:
        for topic, seconds in messages:
            recorder.write(topic, first[topic], seconds * 10**9)
    return folder


def test_all_is_published_once_in_order_latched_topics_first(bag: Bag) -> None:
    played = Played(bag, 0.0)
    assert {message.topic for message in played.messages} == LATCHED
    played.pass_time(1.0)
    assert played.player.ended
    published = [message for message in played.take()[len(LATCHED) :] if message.topic not in MADE]
    assert [message for message in published if message.topic not in CHANGING] == recorded(bag)
    later = [PlayedMessage(topic, data) for topic, stamp, data in bag.raw({"readback"}) if stamp > 1]
    assert [message for message in published if message.topic == "readback"] == later
    assert len(later) == 4  # one command was refused; the watchdog has set one
    assert played.clock == [max(1, tick * 10_000_000) for tick in range(TICKS + 1)]


def test_it_says_that_it_is_a_recording_and_not_what_the_run_was_doing_then(bag: Bag) -> None:
    played = Played(bag, 0.0)
    played.pass_time(1.0)
    played.player.pause()
    played.player.seek(0.3)
    said = [message.data for message in played.take() if message.topic == "run_state"]
    messages = [typestore().deserialize_cdr(data, TOPICS["run_state"].type) for data in said]
    assert [(int(one.tick), one.state, one.text) for one in messages] == [(0, 6, "replaying"), (30, 6, "replaying")]
    assert all(one.reason == str(bag.path) for one in messages)


def test_commands_are_made_from_their_outcomes_and_come_before_them(bag: Bag) -> None:
    played = Played(bag, 0.0)
    played.pass_time(1.0)
    told = [message for message in played.messages if message.topic in {*MADE, "outcomes"} - {EYE}]
    assert [message.topic for message in told] == [
        *("commands", "outcomes", TURN, "outcomes", "commands", "outcomes", SPEED, "outcomes"),
        "outcomes",  # of the watchdog
    ]
    store = typestore()

    def content(index: int, kind: str) -> Any:
        return store.deserialize_cdr(told[index].data, kind)

    both = content(4, types.COMMANDS)
    assert (both.tick, both.names, list(both.values), both.header.frame_id) == (10, [SPEED, TURN], [0.3, 0.25], "hall")
    assert (both.header.stamp.sec, both.header.stamp.nanosec) == (0, 100_000_000)
    assert content(2, types.SPEED).data == -0.2
    assert content(6, types.SPEED).data == 99.0


def test_photo_eyes_are_made_from_the_signals_as_the_live_line_tells_them(
    bag: Bag, live: tuple[Path, list[bytes]]
) -> None:
    played = Played(bag, 0.0)
    played.pass_time(1.0)
    told = [message.data for message in played.take() if message.topic == EYE]
    assert len(told) > 2
    assert told == live[1]
    played.player.pause()
    played.player.seek(0.3)
    assert len([message for message in played.take() if message.topic == EYE]) == 1


@pytest.mark.parametrize("rate", [0.25, 1.0, 8.0])
def test_recorded_time_passes_at_the_rate(bag: Bag, rate: float) -> None:
    played = Played(bag, rate)
    played.pass_time(0.105 / rate)
    assert played.player.time == pytest.approx(0.1)
    played.pass_time(0.3 / rate)
    assert played.player.time == pytest.approx(0.4)


def test_a_pause_holds_and_time_goes_on_where_it_was(bag: Bag) -> None:
    played = Played(bag, 1.0, paused=True)
    assert {message.topic for message in played.take()} == LATCHED
    played.pass_time(0.5)
    assert played.take() == []
    played.player.resume()
    played.pass_time(0.205)
    played.player.pause()
    assert played.player.time == pytest.approx(0.2)
    before = len(played.messages)
    played.clock.clear()
    played.pass_time(5.0)
    assert len(played.messages) == before
    assert set(played.clock) == {200_000_000}
    played.player.toggle()
    played.pass_time(0.105)
    assert played.player.time == pytest.approx(0.31)


@pytest.mark.parametrize("tick", [0, 31, TICKS])
def test_a_seek_tells_what_is_latched_and_the_state_then_goes_on_from_there(bag: Bag, tick: int) -> None:
    played = Played(bag, 0.0)
    played.pass_time(1.0)
    played.take()
    played.player.pause()
    played.player.seek(tick * 0.01)
    told = played.take()
    assert {message.topic for message in told[: len(LATCHED)]} == LATCHED
    state = {
        message.topic: bag.decode(message.topic, message.data)
        for message in told[len(LATCHED) :]
        if message.topic not in MADE
    }
    assert {topic: state[topic].tick for topic in ("bottles", "contacts", "belts", "signals")} == {
        **dict.fromkeys(("bottles", "contacts", "belts"), tick - tick % 2),
        "signals": tick,
    }
    assert {"poses", "markers"} < state.keys()
    played.player.resume()
    played.pass_time(1.0)
    assert [one for one in played.take() if one.topic not in {*MADE, *CHANGING}] == recorded(bag, tick)


def test_a_seek_finds_a_state_that_is_long_past(bag: Bag, tmp_path: Path) -> None:
    """The only belts message comes 100 s before the end."""
    path = write(
        bag, tmp_path / "sparse", [("line", 1), ("belts", 1), *(("signals", second) for second in range(1, 101))]
    )
    with open_bag(path) as sparse:
        playback = Playback(sparse)
        playback.cue(10_000)
        assert [message.topic for message in playback.take(10_000)] == ["belts", EYE, "signals"]


@pytest.mark.parametrize("time", [-0.01, 0.61, float("nan")])
def test_a_time_outside_is_refused_and_changes_nothing(bag: Bag, time: float) -> None:
    played = Played(bag, 1.0)
    played.pass_time(0.1)
    before = played.player.time
    played.take()
    with pytest.raises(Refused, match=r"time: .* given, expected a time of the recording, 0 to 0\.6 \(s\)"):
        played.player.seek(time)
    assert played.take() == []
    assert played.player.time == before
    with pytest.raises(Refused, match="start: "):
        Played(bag, 1.0, start=time)


def test_a_jump_stays_within_the_recording(bag: Bag) -> None:
    played = Played(bag, 1.0, start=0.3, paused=True)
    played.player.jump(-0.2)
    assert played.player.time == pytest.approx(0.1)
    played.player.jump(-5.0)
    assert played.player.time == 0.0
    played.player.jump(5.0)
    assert played.player.time == pytest.approx(0.6)


def test_topics_outside_the_namespace_stay_there_and_the_clock_is_the_players_own(bag: Bag, tmp_path: Path) -> None:
    _, _, line = next(bag.raw({"line"}))
    with (tmp_path / "bag.mcap").open("xb") as stream:
        file = McapFileWriter(stream, "bag.mcap", "jazzy")
        for name, kind in {
            "/hall/line": types.LINE,
            "/hall/belts": "conveyor_msgs/msg/Belts",
            "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
            "/clock": "rosgraph_msgs/msg/Clock",
        }.items():
            schema = Schema(kind, "ros2msg", definition(kind).encode())
            file.add_message(file.add_topic(name, schema, "cdr", {}), line, 1, 1)
        file.finish()
    with open_bag(tmp_path / "bag.mcap") as spaced:
        assert spaced.namespace == "/hall"
        assert {topic.name for topic in Playback(spaced).topics} == {"line", "belts", "run_state", "/diagnostics"}


@pytest.mark.parametrize(
    ("seconds", "sentence"),
    [
        ([1_750_000_000], "recorded in wall time, expected simulated time"),
        ([1, 5], r"holds 2 runs \(messages of line\), expected one"),
    ],
    ids=["wall time", "two runs"],
)
def test_what_has_no_simulated_time_of_one_run_is_refused(
    bag: Bag, tmp_path: Path, seconds: list[int], sentence: str
) -> None:
    path = write(bag, tmp_path / "other", [("line", second) for second in seconds])
    with open_bag(path) as other, pytest.raises(BagError, match=f"other: {sentence}"):
        Playback(other)
