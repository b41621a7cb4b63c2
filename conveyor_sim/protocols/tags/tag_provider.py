# SPDX-License-Identifier: Apache-2.0
"""`TagProvider`: interface between protocol servers and a line; and the provider of a simulation that a test steps."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta, timezone
from typing import TYPE_CHECKING, Literal, Protocol

from conveyor_sim.columns.alarms import AlarmColumns
from conveyor_sim.columns.events import Event
from conveyor_sim.columns.read_back import ReadBackColumns
from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.line.run_state import RUNNING, RunState
from conveyor_sim.line.tag import Tag
from conveyor_sim.protocols.server.interface import Stamps

if TYPE_CHECKING:
    from conveyor_sim.protocols.tags.tag_history import TagHistory
    from conveyor_sim.simulation import Simulation

MODBUS = "modbus"
"""Source of inputs by Modbus."""

OPCUA = "opcua"
"""Source of inputs by OPC UA."""

MQTT = "mqtt"
"""Source of inputs by MQTT."""

WEB = "web"
"""Source of inputs from the web page."""

PLC = "plc"
"""Source of inputs from a PLC to which the line is the client."""

SCADA_SOURCES = (MODBUS, OPCUA, MQTT, WEB, PLC)
"""Sources of inputs from SCADA clients."""

MOST_WAITING = 1000
"""Largest number of inputs of all clients that wait for a tick."""

MOST_EVENTS = 10_000
"""Largest number of events that a provider retains: the newest."""

Control = Literal["pause", "resume", "step", "reset", "seek", "speed", "loop", "target"]
"""Requests to control a run. step: a number of ticks; seek: a simulated time, s; speed: factor of real time; loop: 1 or
0; target: the tick to which a line in lockstep advances (handshake.py).
"""


@dataclass(frozen=True)
class LineInfo:
    """Constant properties of a line while it is served."""

    name: str
    """Name of the scene."""
    where: str
    """Its path in the plant; empty: none."""
    tick: float
    """Length of a tick, s."""
    start_time: str
    """Wall-clock time of simulated time 0, ISO 8601."""
    tags: Sequence[Tag]
    """All tags, in the order of the process image."""


class TickClock:
    """Dates and times of ticks."""

    def __init__(self, info: LineInfo, stamps: Stamps) -> None:
        """Read the start time. stamps: kind of time for the time stamps of values."""
        self._start = datetime.fromisoformat(info.start_time.replace("Z", "+00:00")).astimezone(timezone.utc)
        self._tick = info.tick
        self.is_simulated = stamps == "simulated"

    def simulated(self, tick: float) -> datetime:
        """Return the date of a tick in simulated time, which starts at the scene's `start_time`."""
        try:
            return self._start + timedelta(seconds=tick * self._tick)
        except OverflowError:
            return datetime.max.replace(tzinfo=timezone.utc)

    def stamp(self, tick: float, heard: datetime) -> datetime:
        """Return the time stamp of a value of a tick. heard: wall time at which the server received it."""
        return self.simulated(tick) if self.is_simulated else heard

    def tick_at(self, date: datetime) -> float:
        """Return the tick of a date in simulated time, with a fraction; below 0 before the start."""
        return (date - self._start).total_seconds() / self._tick


@dataclass(frozen=True)
class LineSnapshot:
    """Snapshot of a line at one tick. It never changes, so any thread may read it."""

    tick: int
    values: Mapping[str, float]
    """Values by name: all signals as controllers read them, and all commands in force."""
    forced: frozenset[str] = frozenset()
    """Signals that are forced."""
    run: RunState = field(default_factory=lambda: RunState(RUNNING))
    read_back: ReadBackColumns | None = None
    """Read-back of the commands: writers and times; None: not known yet."""
    alarms: AlarmColumns | None = None
    """States of the alarms; None: not known yet."""
    lost: str = ""
    """Reason why there are no newer values; empty: the connection to the line is up."""
    run_id: str = ""
    """Run ID, which changes on every reset and invalidates all earlier data; "": unknown."""
    owner: str = ""
    """Controller that owns the line, as far as known; empty: none."""
    released: tuple[str, ...] = ()
    """Patterns of the devices that the owner has released to other controllers."""


class TagProvider(Protocol):
    """Tag values of a line, with a method to submit inputs. Its methods may be called from any thread."""

    @property
    def info(self) -> LineInfo:
        """Constant properties of the line."""

    @property
    def snapshot(self) -> LineSnapshot:
        """Latest snapshot of the line."""

    @property
    def controls(self) -> frozenset[Control]:
        """Requests that `control` accepts."""

    @property
    def history(self) -> TagHistory | None:
        """History of the tags; None: no history is available."""

    def events(self, after: int) -> tuple[int, Sequence[Event]]:
        """Return the number of events so far, and the events after the first `after`, unless they are too old."""

    def listen(self, heard: Callable[[], None]) -> Callable[[], None]:
        """Call `heard`, in any thread, after each change of `snapshot`. Return a function that removes `heard`.

        `heard` must not block and must not raise.
        """

    def give(self, request: Input) -> str:
        """Queue an input for the next tick. Return the reason for a refusal, "" if it was queued."""

    def control(self, what: Control, value: float, by: str) -> str:
        """Control the run on behalf of `by`. Return the reason for a refusal, "" if the request was accepted."""


class Listeners:
    """Functions to call when something has changed. May be used from any thread."""

    def __init__(self) -> None:
        """Start without functions."""
        self._all: tuple[Callable[..., None], ...] = ()
        self._changing = threading.Lock()

    def add(self, heard: Callable[..., None]) -> Callable[[], None]:
        """Add a function. Return a function that removes it."""
        with self._changing:
            self._all = (*self._all, heard)

        def end() -> None:
            with self._changing:
                self._all = tuple(other for other in self._all if other is not heard)

        return end

    def tell(self, *news: object) -> None:
        """Call all functions with `news`."""
        for heard in self._all:
            heard(*news)


class RecentEvents:
    """Latest events of a line. One thread adds events, any thread may read them."""

    def __init__(self) -> None:
        """Start without events."""
        self._kept: tuple[int, tuple[Event, ...]] = (0, ())  # one attribute, so that both are consistent

    def add(self, events: Sequence[Event]) -> None:
        """Append events."""
        if events:
            total, last = self._kept
            self._kept = total + len(events), (*last, *events)[-MOST_EVENTS:]

    def bring(self, total: int, newest: Sequence[Event]) -> None:
        """Add the newest of `total` events; events between the stored ones and these may be missing."""
        if newest:
            _, last = self._kept
            self._kept = total, (*last, *newest)[-MOST_EVENTS:]

    def after(self, count: int) -> tuple[int, Sequence[Event]]:
        """Return the number of events so far, and the events after the first `count`."""
        total, last = self._kept
        new = min(max(total - count, 0), len(last))
        return total, last[len(last) - new :]


class SteppedTagProvider:
    """Tag provider of a simulation that one thread steps.

    That thread passes the inputs on before a tick, and takes a snapshot after it.
    """

    controls: frozenset[Control] = frozenset()
    """Empty set: only the stepping thread advances time."""

    def __init__(self, simulation: Simulation) -> None:
        """Start with a snapshot of the simulation."""
        self._simulation = simulation
        self._waiting: deque[Input] = deque()
        self._listeners = Listeners()
        self._events = RecentEvents()
        image, scene = simulation.process_image, simulation.scene
        self._names = (*image.signal_names, *image.command_names)
        self._signal_names = image.signal_names
        self._info = LineInfo(scene.name, scene.where, scene.tick, scene.start_time, image.tags)
        self._alarms, self._read_back = simulation.line.alarms.columns(), simulation.line.read_back.columns()
        self._show()

    @property
    def info(self) -> LineInfo:
        """Constant properties of the line."""
        return self._info

    @property
    def snapshot(self) -> LineSnapshot:
        """Snapshot at the end of the last tick."""
        return self._snapshot

    @property
    def history(self) -> TagHistory | None:
        """No history is available."""
        return None

    def events(self, after: int) -> tuple[int, Sequence[Event]]:
        """Return the number of events since the start, and the events after the first `after`."""
        return self._events.after(after)

    def listen(self, heard: Callable[[], None]) -> Callable[[], None]:
        """Call `heard` after each tick. Return a function that ends this."""
        return self._listeners.add(heard)

    def give(self, request: Input) -> str:
        """Queue an input for the next tick. Return the reason for a refusal, "" if it was queued."""
        if len(self._waiting) >= MOST_WAITING:
            return f"{MOST_WAITING} inputs wait for the next tick already"
        self._waiting.append(request)
        return ""

    def control(self, what: Control, value: float, by: str) -> str:
        """Refuse."""
        return f"{what}: the test decides when time passes, expected no control of the run"

    def before_tick(self) -> None:
        """Pass waiting inputs on to the simulation. Called by the stepping thread."""
        for _ in range(len(self._waiting)):
            self._simulation.give(self._waiting.popleft())

    def after_tick(self) -> None:
        """Take a snapshot and notify listeners. Called by the stepping thread."""
        self._look()
        self._show()
        self._listeners.tell()

    @property
    def _run(self) -> RunState:
        return RunState(RUNNING)

    def _look(self) -> None:
        """Update alarms and read-back if they changed, and collect events."""
        line = self._simulation.line
        self._alarms = line.alarms.changes() or self._alarms
        self._read_back = line.read_back.changes() or self._read_back
        self._events.add(self._simulation.line.happened)

    def _show(self) -> None:
        simulation = self._simulation
        signals = simulation.line.signals()
        values = [*signals.values.tolist(), *simulation.line.read_back.values]
        self._snapshot = LineSnapshot(
            simulation.tick,
            dict(zip(self._names, values, strict=True)),
            frozenset(self._signal_names[place] for place in signals.forced),
            self._run,
            self._read_back,
            self._alarms,
            owner=simulation.line.modes.owner,
            released=tuple(simulation.line.modes.released),
        )
