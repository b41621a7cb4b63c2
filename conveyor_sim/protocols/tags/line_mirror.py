# SPDX-License-Identifier: Apache-2.0
"""`LineMirror`: copy of a line made from its topics, which come from a process, a recording or a node."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from numpy.typing import NDArray

from conveyor_sim.bag.messages import encode
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.messages.typestore import typestore
from conveyor_sim.columns.alarms import AlarmColumns
from conveyor_sim.columns.events import Event, EventColumns
from conveyor_sim.columns.image import Image
from conveyor_sim.columns.read_back import ReadBackColumns
from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.line.run_state import ENDED, RUNNING, STOPPED, RunState
from conveyor_sim.line.tag import Tag
from conveyor_sim.protocols.server.interface import Health
from conveyor_sim.protocols.tags.tag_provider import LineInfo, LineSnapshot, Listeners, RecentEvents, TagProvider
from conveyor_sim.run.inbox import MESSAGE_BYTES, TOO_LARGE, size_of

if TYPE_CHECKING:
    from conveyor_sim.protocols.tags.tag_history import TagHistory

STATE_TOPICS = ("line", "run_state", "signals", "events", "readback", "alarm_states")
"""Topics that update the snapshot."""

DRAWING_TOPICS = ("bottles", "contacts", "belts", "counters", "rail_wear")
"""Topics for drawings only. They are decoded on demand."""

NOTHING = "no data of the line have arrived yet"


class LineMirrorError(ConveyorError):
    """Error: a line can't be mirrored."""


@dataclass(frozen=True)
class DrawableFrame:
    """Latest data for drawing a line."""

    line: Any
    """Decoded message of topic `line`."""
    tick: int
    at: float
    """Wall time of the tick, s since 1970."""
    signals: NDArray[Any]
    """Values of all signals as controllers read them."""
    forced: NDArray[Any]
    """Indices of the forced signals."""
    faults: Mapping[str, float]
    """Values of the faults that are injected, by name."""
    drawn: Mapping[str, Callable[[], Any]]
    """Decoders of the latest message by topic of DRAWING_TOPICS. A new message has a new decoder."""


class DrawableProvider(TagProvider, Protocol):
    """Tag provider with data for drawings."""

    takes_inputs: bool

    @property
    def frame(self) -> DrawableFrame:
        """Latest data for drawing the line."""

    @property
    def newest(self) -> Mapping[str, bytes]:
        """Latest message by topic, serialized."""

    servers: tuple[Health, ...]
    """Health of the protocol servers of the line."""
    recording: Path | None
    """Recording that is played back; None: no recording."""

    @property
    def era(self) -> int:
        """Number that changes when earlier messages become invalid."""

    def watch(self) -> Callable[[], None]:
        """Start to receive DRAWING_TOPICS. Return a function that ends this."""

    def hear(self, heard: Callable[[str, bytes], None]) -> Callable[[], None]:
        """Call `heard` with the topic and bytes of each message from now on. Return a function that ends this.

        `heard` must not block and must not raise.
        """


class LineMirror:
    """Read-only part of a `TagProvider`. One thread updates it, any thread may read it.

    `show` publishes all updates at once. Time may go back, and another run of the same line may begin.
    """

    takes_inputs = True
    """True if the line accepts inputs."""
    recording: Path | None = None
    """Recording that is played back; None: the line is simulated."""
    _run_id: str
    _tick: int
    _line: Any
    _drawn: dict[str, Callable[[], Any]]
    _run: RunState
    _image: Image | None
    _read_back: ReadBackColumns | None
    _alarms: AlarmColumns | None
    _owner: str
    _released: tuple[str, ...]
    _faults: dict[str, float]

    def __init__(self) -> None:
        """Start empty."""
        self._info: LineInfo | None = None
        self._signal_names: Sequence[str] = ()
        self._command_names: Sequence[str] = ()
        self._initial: list[float] = []
        self._listeners = Listeners()
        self._events = RecentEvents()
        self._known = threading.Event()
        self._strange = False  # True if the topics describe another line now
        self._snapshot = LineSnapshot(0, {}, lost=NOTHING)
        self._frame: DrawableFrame | None = None
        self._watchers = 0
        self._watching = threading.Lock()
        self._hearers = Listeners()
        self._newest: dict[str, bytes] = {}
        self._era = 0
        self.servers: tuple[Health, ...] = ()
        """Health of the protocol servers of the line; empty: not known in this process."""
        self._forget("")

    @property
    def info(self) -> LineInfo:
        """Constant properties. Raises RuntimeError before they are known."""
        if self._info is None:
            raise RuntimeError("the line is not known yet")
        return self._info

    @property
    def snapshot(self) -> LineSnapshot:
        """Latest snapshot of the line."""
        return self._snapshot

    @property
    def frame(self) -> DrawableFrame:
        """Latest data for drawing. Raises RuntimeError before there are any."""
        if self._frame is None:
            raise RuntimeError("there is no snapshot yet")
        return self._frame

    @property
    def newest(self) -> Mapping[str, bytes]:
        """Latest message by topic, serialized."""
        return self._newest

    @property
    def era(self) -> int:
        """Number that changes when earlier messages become invalid: after a reset, or a seek in a recording."""
        return self._era

    def watch(self) -> Callable[[], None]:
        """Start to receive DRAWING_TOPICS where they are sent on demand only. Return a function that ends this."""
        self._count_watchers(1)
        return lambda: self._count_watchers(-1)

    @property
    def history(self) -> TagHistory | None:
        """No history is available."""
        return None

    def hear(self, heard: Callable[[str, bytes], None]) -> Callable[[], None]:
        """Call `heard` with the topic and bytes of each message from now on. Return a function that ends this."""
        return self._hearers.add(heard)

    def events(self, after: int) -> tuple[int, Sequence[Event]]:
        """Return the number of events so far, and the events after the first `after`."""
        return self._events.after(after)

    def listen(self, heard: Callable[[], None]) -> Callable[[], None]:
        """Call `heard` after each change of `snapshot`. Return a function that ends this."""
        return self._listeners.add(heard)

    def wait(self, seconds: float) -> bool:
        """Block until there is a first snapshot, or `seconds` (wall time) have passed. Return True if there is one."""
        return self._known.wait(seconds)

    def _objection(self, request: Input) -> str:
        """Return the reason why an input can't be passed on to the line, "" if it can."""
        snapshot = self.snapshot
        if snapshot.lost:
            return snapshot.lost
        if snapshot.run.state in (ENDED, STOPPED):
            return f"the run has {snapshot.run.text}, expected a reset"
        return TOO_LARGE if size_of(request) > MESSAGE_BYTES else ""

    # Called by the thread that receives messages

    def take(self, topic: str, message: Any) -> None:
        """Take a decoded message of one of STATE_TOPICS.

        Raises LineMirrorError for another line than before; its other messages are ignored.
        """
        if self._strange and topic != "line":
            return
        match topic:
            case "line":
                self._take_line(message)
            case "run_state":
                self._run = TOPICS[topic].unpack(message)
            case "signals":
                self._tick, self._image = int(message.tick), encode.to_image(message)
            case "readback":
                self._read_back = TOPICS[topic].unpack(message)
            case "alarm_states":
                self._alarms = TOPICS[topic].unpack(message)
            case "events":
                self._take_events(TOPICS[topic].unpack(message))

    def receive(self, states: Mapping[str, bytes], decode: Callable[[str, bytes], Any]) -> None:
        """Take the serialized newest messages by topic, in the order of STATE_TOPICS and DRAWING_TOPICS."""
        for topic in (*STATE_TOPICS, *DRAWING_TOPICS):
            if (data := states.get(topic)) is not None:
                if topic in STATE_TOPICS:
                    self.take(topic, decode(topic, data))
                else:
                    self.keep(topic, partial(decode, topic, data))
                self.pass_on(topic, data)

    def receive_events(self, messages: Iterable[bytes], decode: Callable[[str, bytes], Any]) -> None:
        """Take serialized messages of topic `events`."""
        for data in messages:
            self.take("events", decode("events", data))
            self.pass_on("events", data)

    def pass_on(self, topic: str, data: bytes) -> None:
        """Notify listeners of a serialized message of one of STATE_TOPICS and DRAWING_TOPICS."""
        self._newest[topic] = data
        self._hearers.tell(topic, data)

    def keep(self, topic: str, decode: Callable[[], Any]) -> None:
        """Store the decoder of a message of one of DRAWING_TOPICS. It may be called by any thread."""
        self._drawn[topic] = decode

    def state_run(self, run: RunState) -> None:
        """Set the state of the run if no message contains it."""
        self._run = run

    def forget(self) -> None:
        """Discard the present state, because the recording jumps or another run begins."""
        self._forget(self._run_id)

    def show(self, at: float | None = None) -> None:
        """Publish a snapshot of all updates, once signals have arrived. Its `lost` is empty.

        at: wall time of its tick, s since 1970; None: now.
        """
        if self._info is None or self._image is None:
            return
        names, values = self._signal_names, self._image.values
        tags = dict(zip(names, values.tolist(), strict=False))
        tags |= zip(self._command_names, self._commands(), strict=False)
        now = time.time() if at is None else at
        self._frame = DrawableFrame(
            self._line, self._tick, now, self._image.values, self._image.forced, dict(self._faults), dict(self._drawn)
        )
        self._snapshot = LineSnapshot(
            self._tick,
            tags,
            frozenset(names[place] for place in self._image.forced if place < len(names)),
            self._run,
            self._read_back,
            self._alarms,
            run_id=self._run_id,
            owner=self._owner,
            released=self._released,
        )
        self._known.set()
        self._listeners.tell()

    def lose(self, reason: str) -> None:
        """Mark the line as lost, for a reason. The latest snapshot stays."""
        if self._snapshot.lost != reason:
            self._snapshot = replace(self._snapshot, lost=reason)
            self._listeners.tell()

    def add(self, event: Event) -> None:
        """Add an event that did not arrive in a message."""
        self._events.add([event])

    def _count_watchers(self, more: int) -> None:
        """Add to the number of watchers. From any thread."""
        with self._watching:
            before, self._watchers = self._watchers, self._watchers + more
            if (before > 0) != (self._watchers > 0):
                self._watched(self._watchers > 0)

    def _watched(self, on: bool) -> None:
        """Start or stop receiving DRAWING_TOPICS."""

    def _forget(self, run_id: str) -> None:
        self._newest = {topic: data for topic, data in self._newest.items() if topic == "line"}
        self._era += 1
        self._run_id = run_id
        self._tick = 0
        self._drawn = {}
        self._run = RunState(RUNNING)
        self._image = self._read_back = self._alarms = None
        self._owner = ""
        self._released = ()
        self._faults = {}

    def _take_line(self, message: Any) -> None:
        info = line_info(message)
        self._strange = self._info is not None and self._info != info
        if self._info is not None and self._strange:
            self._forget(message.run_id)
            raise LineMirrorError(
                f"{info.name}: the line or its tags have changed; expected {self._info.name} with the same tags; "
                "restart the servers"
            )
        if message.run_id != self._run_id or self._info is None:
            self._forget(message.run_id)
        self._info, self._line = info, message
        initial = {tag.name: tag.initial for tag in info.tags}
        self._initial = [initial.get(name, 0.0) for name in message.command_names]
        self._signal_names, self._command_names = tuple(message.signal_names), tuple(message.command_names)

    def _take_events(self, columns: EventColumns) -> None:
        rows = zip(
            columns.at.tolist(),
            columns.kind,
            columns.name,
            columns.bottle.tolist(),
            columns.value.tolist(),
            columns.text,
            strict=True,
        )
        events = [Event(*row) for row in rows]
        for event in events:
            if event.kind == "fault_injected":
                self._faults[event.name] = event.value
            elif event.kind == "fault_cleared":
                self._faults.pop(event.name, None)
            elif event.kind == "owner_changed":
                self._owner = event.name if event.value else ""
                text = event.text.removeprefix("released: ")
                self._released = tuple(text.split(", ")) if self._owner and text else ()
        self._events.add(events)

    def _commands(self) -> list[float]:
        """Return the values of all commands: read back, or initial before the first read-back."""
        if self._read_back is None:
            return self._initial
        values: list[float] = self._read_back.value.tolist()
        return values


def decoded(topic: str, data: bytes) -> Any:
    """Return the decoded message of a topic. It must have been serialized by this version."""
    return typestore().deserialize_cdr(data, TOPICS[topic].type)


def line_info(message: Any) -> LineInfo:
    """Return the constant properties from a message of topic `line`.

    Raises LineMirrorError for a recording from before there were tags.
    """
    if message.format == 1:
        raise LineMirrorError(
            f"{message.scene_name}: recorded without tags, by an older version; expected a newer recording"
        )
    tags = tuple(
        Tag(
            name=tag.name,
            kind=tag.kind,
            role=tag.role,
            description=tag.description,
            unit=tag.unit,
            low=tag.min,
            high=tag.max,
            initial=tag.initial,
            nominal=tag.nominal or None,
            texts=dict(zip(tag.state_values.tolist(), tag.state_texts, strict=True)),
            device=tag.device,
            device_class=tag.device_class,
        )
        for tag in message.tags
    )
    return LineInfo(message.scene_name, message.where, message.tick_ns * 1e-9, message.start_time, tags)
