# SPDX-License-Identifier: Apache-2.0
"""`Playback`: the messages of a recording by tick, and the state at the target of a seek. `Player` publishes them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from conveyor_sim.bag.messages import encode, topics
from conveyor_sim.bag.messages.encode import Header, Outcome, to_outcome
from conveyor_sim.bag.messages.qos import EVENTS, LATCHED, Qos
from conveyor_sim.bag.messages.typestore import typestore
from conveyor_sim.bag.reader import Bag
from conveyor_sim.errors import BagError
from conveyor_sim.line.commands.inputs import SET
from conveyor_sim.line.run_state import REPLAYING, RunState
from conveyor_sim.line.tag import speed_topics
from conveyor_sim.run.lockstep import Refused
from conveyor_sim.run.pacing import Pacer
from conveyor_sim.support.printable import printable

OWN = frozenset({"/clock", "/rosout", "/parameter_events"})
"""Topics that the playback node publishes itself."""

RUN_STATE = "run_state"
"""Topic that marks the run as a playback. Recorded messages of this topic are not played."""

WALL_CLOCK = 10**18
"""Later log times are dates (from 2001 on), not simulated times, ns."""

LOOK_BACK = 10**9
"""Time that a search for a state covers first, ns."""


class PlayedMessage(NamedTuple):
    """A serialized message to be published."""

    topic: str
    data: bytes


@dataclass(frozen=True)
class PlayedTopic:
    """A topic that is played back. Its name is that in OUTPUTS, or absolute if outside the namespace of the bag."""

    name: str
    type: str
    qos: Qos
    type_hash: str | None
    """RIHS01 hash of the recorded type; None if messages are made or converted here."""

    @property
    def latched(self) -> bool:
        """True if late subscribers receive the last message."""
        return self.qos.latched

    @property
    def event(self) -> bool:
        """True if messages report events, not states."""
        row = topics.TOPICS.get(self.name)
        return row is not None and row.each_counts


class Playback:
    """The messages of an open bag by tick: `cue` goes to a tick, `take` then yields tick after tick.

    Some topics are not recorded because others hold their content. Playback derives these messages from the recorded
    ones and publishes them first. Commands come from `outcomes`: on `belts/<belt>/cmd_speed` or
    `drives/<drive>/cmd_speed` if they were sent there, else on `commands`, even refused ones. `photo_eyes/<eye>` come
    from `signals`. Messages of earlier formats are played in the present definition.
    """

    def __init__(self, bag: Bag, only: Collection[str] | None = None) -> None:
        """only: recorded topics to play, without topics made from others; None: all topics.

        Raises BagError if the bag's times are not simulated times of one run.
        """
        self._bag = bag
        first_ns, last_ns = bag.span_ns
        if first_ns > WALL_CLOCK:
            raise BagError(
                f"{bag.path}: recorded in wall time, expected simulated time, as `record` and `conveyor-sim run` do it"
            )
        if (runs := bag.counts["line"]) > 1:
            raise BagError(f"{bag.path}: holds {runs} runs (messages of line), expected one")
        self.tick_ns = int(bag.line.tick_ns)
        self.first_tick = first_ns // self.tick_ns
        self.last_tick = -(-last_ns // self.tick_ns)
        qos = bag.qos
        recorded = [
            PlayedTopic(name, kind, qos[name], None if name in bag.older_topics else bag.type_hash(name))
            for name, kind in bag.types.items()
            if (name if name.startswith("/") else f"{bag.namespace}/{name}") not in OWN and name != RUN_STATE
            if only is None or name in only
        ]
        known = {topic.name for topic in recorded}
        made = [PlayedTopic(RUN_STATE, encode.RUN_STATE, LATCHED, None)]
        if "outcomes" in known and only is None:
            made.append(PlayedTopic("commands", encode.COMMANDS, EVENTS, None))
            speeds = speed_topics(bag.line.belts, bag.line.command_names)
            made += [PlayedTopic(name, encode.SPEED, EVENTS, None) for name in speeds]
        eyes = _photo_eyes(bag.line.signal_names) if "signals" in known and only is None else {}
        made += [PlayedTopic(eye, encode.BOOL, LATCHED, None) for eye in eyes]
        self.topics = (*recorded, *(topic for topic in made if topic.name not in known))
        self._recorded = known
        self._made = {topic.name for topic in self.topics} - known
        self._eyes = {eye: column for eye, column in eyes.items() if eye in self._made}
        self._seen: dict[str, bool] = {}  # last published state of each photo-eye since the last cue
        self._latched = {topic.name for topic in recorded if topic.latched}
        self._states = {topic.name for topic in recorded if not topic.latched and not topic.event}
        self._cued_ns = 0
        self._due: list[PlayedMessage] = []
        self._stream: Iterator[tuple[str, int, bytes]] = iter(())
        self._next: tuple[str, int, bytes] | None = None

    def stamp_ns(self, tick: int) -> int:
        """Return the simulated time of a tick, ns. Tick 0 is stamped 1, because ROS reads 0 as "not set"."""
        return max(1, tick * self.tick_ns)

    def cue(self, tick: int) -> list[PlayedMessage]:
        """Go to a tick. Return its latched messages. The next `take` begins with the state at that tick."""
        after_ns = self.stamp_ns(tick - 1) if tick > self.first_tick else -1
        self._cued_ns = self.stamp_ns(tick)
        self._seen.clear()
        latched = self._last_before(self._cued_ns + 1, self._latched)
        latched += self._first_after(self._cued_ns + 1, self._latched - {message.topic for message in latched})
        now = {topic for topic, _, _ in self._bag.raw(self._states, after_ns + 1, self._cued_ns + 1)}
        self._due = self._last_before(after_ns + 1, self._states - now)
        self._stream = self._bag.raw(self._recorded, after_ns + 1)
        self._next = next(self._stream, None)
        header = Header(tick, self._cued_ns, "")
        replaying = encode.run_state_message(RunState(REPLAYING, printable(self._bag.path)), header)
        return [*latched, PlayedMessage(RUN_STATE, replaying)]

    def take(self, tick: int) -> Iterator[PlayedMessage]:
        """Yield the remaining messages up to a tick, in the order of recording."""
        due, self._due = self._due, []
        for message in due:
            yield from self._with_made(message)
        stamp_ns = self.stamp_ns(tick)
        while self._next is not None and self._next[1] <= stamp_ns:
            topic, stamp, data = self._next
            self._next = next(self._stream, None)
            if topic in self._latched and stamp <= self._cued_ns:
                continue
            yield from self._with_made(self._played(topic, data))

    def decode(self, topic: str, data: bytes) -> Any:
        """Return the decoded message of a recorded topic that was played. Raise BagError as `Bag.decode`."""
        if topic not in self._bag.older_topics:
            return self._bag.decode(topic, data)
        return typestore().deserialize_cdr(data, self._bag.types[topic])

    def _played(self, topic: str, data: bytes) -> PlayedMessage:
        """Return a recorded message as it is played: unchanged, or converted from an older definition."""
        if topic in self._bag.older_topics:
            data = bytes(typestore().serialize_cdr(self._bag.decode(topic, data), self._bag.types[topic]))
        return PlayedMessage(topic, data)

    def _with_made(self, message: PlayedMessage) -> Iterator[PlayedMessage]:
        """Yield the messages derived from a message, then the message itself."""
        if message.topic == "outcomes":
            yield from self._sent(message.data)
        elif message.topic == "signals" and self._eyes:
            signals = self.decode("signals", message.data)
            for eye, column in self._eyes.items():
                blocked = bool(signals.values[column])
                if self._seen.get(eye) is not blocked:
                    self._seen[eye] = blocked
                    yield PlayedMessage(eye, encode.bool_message(blocked, _header(signals)))
        yield message

    def _last_before(self, stop_ns: int, topics: set[str]) -> list[PlayedMessage]:
        """Return the last message of each topic before a time, in the order of recording."""
        last: dict[str, tuple[int, int, bytes]] = {}
        span, missing = LOOK_BACK, set(topics)
        first_ns, _ = self._bag.span_ns
        while missing and stop_ns > first_ns:
            start_ns = stop_ns - span
            for place, (topic, stamp, data) in enumerate(self._bag.raw(missing, start_ns, stop_ns)):
                last[topic] = (stamp, place, data)
            missing -= last.keys()
            stop_ns, span = start_ns, 2 * span
        return [self._played(topic, last[topic][2]) for topic in sorted(last, key=lambda name: last[name][:2])]

    def _first_after(self, start_ns: int, topics: set[str]) -> list[PlayedMessage]:
        """Return the first message of each topic from a time on, in the order of recording."""
        first: dict[str, bytes] = {}
        for topic, _, data in self._bag.raw(topics, start_ns) if topics else ():
            first.setdefault(topic, data)
            if len(first) == len(topics):
                break
        return [self._played(topic, data) for topic, data in first.items()]

    def _sent(self, data: bytes) -> Iterator[PlayedMessage]:
        """Yield the command of a command result, if it was sent as one and its topic is not recorded."""
        message = self.decode("outcomes", data)
        outcome: Outcome = to_outcome(message)
        if outcome.operation != SET or outcome.input.by_line:  # it was not sent as a command
            return
        if outcome.source in self._made and outcome.names == (outcome.source,) and len(outcome.values) == 1:
            yield PlayedMessage(outcome.source, encode.speed_message(outcome.values[0]))
        elif "commands" in self._made and outcome.source not in self._recorded:
            yield PlayedMessage("commands", encode.commands_message(outcome.names, message.values, _header(message)))


def _header(message: Any) -> Header:
    """Return the header of a decoded message."""
    stamp = message.header.stamp
    return Header(message.tick, stamp.sec * 10**9 + stamp.nanosec, message.header.frame_id)


def _photo_eyes(signal_names: Sequence[str]) -> dict[str, int]:
    """Return the column of the signal `blocked` of each photo-eye, by topic."""
    ends = ("photo_eyes/", "/blocked")
    return {
        name.removesuffix(ends[1]): column
        for column, name in enumerate(signal_names)
        if name.startswith(ends[0]) and name.endswith(ends[1])
    }


IDLE = 0.01
"""Time between two beats while no tick is due, s of wall time."""


class Player:
    """Publishes the messages of a recording tick by tick against wall time, with pause and seek.

    Callers pass wall times, as seconds of any steady clock. Only one thread may use it.
    """

    def __init__(
        self,
        playback: Playback,
        rate: float,
        *,
        start: float | None,
        paused: bool,
        publish: Callable[[PlayedMessage], None],
        beat: Callable[[int, float], None],
    ) -> None:
        """Publish latched messages at once. The first call of `step` while not paused publishes the first tick.

        rate: recorded seconds per wall second, 0 for as fast as possible. start: simulated time, s; None for the
        beginning. beat: called after each tick and while idle, with the simulated time in ns and the wall time in s.
        Raises Refused if `start` is not within the recording.
        """
        self._playback = playback
        self._publish = publish
        self._beat = beat
        self._pacer = Pacer(rate, playback.tick_ns * 1e-9)
        self.paused = paused
        self._next = playback.first_tick if start is None else self._tick_at("start", start)
        self._shown = self._next  # tick that /clock shows
        self._cue(self._next)

    @property
    def time(self) -> float:
        """Simulated time of the last tick published, s."""
        return self._seconds(self._shown)

    @property
    def span(self) -> tuple[float, float]:
        """Simulated times of the first and the last tick, s."""
        return self._seconds(self._playback.first_tick), self._seconds(self._playback.last_tick)

    @property
    def ended(self) -> bool:
        """True once the last tick has been played."""
        return self._next > self._playback.last_tick

    def pause(self) -> None:
        """Stop simulated time; /clock continues to publish it."""
        self.paused = True

    def resume(self) -> None:
        """Continue at the rate."""
        if self.paused:
            self._pacer.restart()
            self.paused = False

    def set_rate(self, rate: float) -> None:
        """Set the recorded seconds per wall second from the next tick on, 0 for as fast as possible."""
        self._pacer.factor = rate

    def toggle(self) -> None:
        """Pause, or resume."""
        if self.paused:
            self.resume()
        else:
            self.pause()

    def seek(self, time: float) -> None:
        """Go to a time (s) and publish latched messages and the state there, even while paused.

        Raises Refused if the time is outside the recording; nothing has changed then.
        """
        self._cue(self._tick_at("time", time))
        self._play_tick()
        self._pacer.restart()

    def jump(self, by: float) -> None:
        """Seek `by` seconds ahead, or back if negative, but not beyond the recording."""
        first, last = self.span
        self.seek(min(max(self.time + by, first), last))

    def step(self, now: float) -> float:
        """Play the next tick if it is due at `now`. Return the seconds until the next call is useful."""
        wait = IDLE if self.paused or self.ended else self._pacer.wait(now)
        if wait == 0.0:
            self._play_tick()
            self._pacer.ticked(now)
            wait = self._pacer.wait(now)
        self._beat(self._playback.stamp_ns(self._shown), now)
        return min(wait, IDLE)

    def _cue(self, tick: int) -> None:
        for message in self._playback.cue(tick):
            self._publish(message)
        self._next = self._shown = tick

    def _play_tick(self) -> None:
        for message in self._playback.take(self._next):
            self._publish(message)
        self._shown = self._next
        self._next += 1

    def _tick_at(self, what: str, time: float) -> int:
        first, last = self.span
        if not first <= time <= last:
            raise Refused(f"{what}: {time:g} given, expected a time of the recording, {first:g} to {last:g} (s)")
        return round(time * 1e9 / self._playback.tick_ns)

    def _seconds(self, tick: int) -> float:
        return tick * self._playback.tick_ns * 1e-9
