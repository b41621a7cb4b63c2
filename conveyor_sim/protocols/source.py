"""`TagSource`: what a SCADA face knows of a line, wherever that runs; and the source that a stepped simulation is."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, Protocol

from conveyor_sim.columns.alarms import AlarmColumns
from conveyor_sim.columns.events import Event
from conveyor_sim.columns.read_back import ReadBackColumns
from conveyor_sim.line.inputs import Input
from conveyor_sim.line.run_state import RUNNING, RunState
from conveyor_sim.line.tag import Tag

if TYPE_CHECKING:
    from conveyor_sim.protocols.past import Past
    from conveyor_sim.simulation import Simulation

MODBUS = "modbus"
"""Source of inputs that come by Modbus."""

OPCUA = "opcua"
"""Source of inputs that come by OPC UA."""

MQTT = "mqtt"
"""Source of inputs that come by MQTT."""

WEB = "web"
"""Source of inputs that come by the page."""

PLC = "plc"
"""Source of what a PLC commands whose client the line is."""

FACES = (MODBUS, OPCUA, MQTT, WEB, PLC)
"""Sources of inputs that SCADA clients give."""

MOST_WAITING = 1000
"""Inputs that wait for a tick at once, from all clients of all faces."""

MOST_EVENTS = 10_000
"""That a source keeps, the last ones."""

Control = Literal["pause", "resume", "step", "reset", "seek", "speed", "loop", "target"]
"""What can be asked of a run. step: so many ticks; seek: to a simulated time, s; speed: times real time; loop: 1, 0;
target: the tick up to which a line in lockstep goes (handshake.py)."""


@dataclass(frozen=True)
class About:
    """What stays the same of a line for as long as it is served."""

    name: str
    """Of the scene."""
    where: str
    """Its path in the plant; empty: none."""
    tick: float
    """Length of a tick, s."""
    start_time: str
    """The wall-clock time that simulated time 0 stands for, ISO 8601."""
    tags: Sequence[Tag]
    """All tags, in the order of the process image."""


@dataclass(frozen=True)
class Shown:
    """A line at one tick. It never changes, so any thread may read it."""

    tick: int
    values: Mapping[str, float]
    """Of all signals as controllers read them, and of all commands as they are in force, by name."""
    forced: frozenset[str] = frozenset()
    """Signals that are forced."""
    run: RunState = field(default_factory=lambda: RunState(RUNNING))
    read_back: ReadBackColumns | None = None
    """Who set the commands, and when; None: not known yet."""
    alarms: AlarmColumns | None = None
    """None: not known yet."""
    lost: str = ""
    """Why nothing newer will come before the source is back; empty: it is there."""
    run_id: str = ""
    """Of the run: another one after a reset, to which nothing holds that the one before was told; "": unknown."""
    owner: str = ""
    """The controller that owns the line, as far as is known; empty: none."""
    released: tuple[str, ...] = ()
    """Patterns of the devices that it leaves to others."""


class TagSource(Protocol):
    """Tags with their values, and a way in for inputs. Its methods may be called from any thread."""

    @property
    def about(self) -> About:
        """What stays the same."""

    @property
    def shown(self) -> Shown:
        """The line as it was last."""

    @property
    def controls(self) -> frozenset[Control]:
        """What `control` can do here."""

    @property
    def past(self) -> Past | None:
        """What its tags were before now; None: nobody knows but who has listened."""

    def events(self, after: int) -> tuple[int, Sequence[Event]]:
        """How many events there were so far, and those after so many; the oldest may be forgotten."""

    def listen(self, heard: Callable[[], None]) -> Callable[[], None]:
        """Have a function called after `shown` has changed, by any thread; what is returned ends that.

        It must not block, and must not raise.
        """

    def give(self, given: Input) -> str:
        """Have an input judged and applied as the next tick begins. Why it can't wait for that, "" if it does."""

    def control(self, what: Control, value: float, by: str) -> str:
        """Ask something of the run, in the name of somebody. Why that can't be, "" if it will be done."""


class Listeners:
    """Functions that are called when something has changed. From any thread."""

    def __init__(self) -> None:
        """Start without functions."""
        self._all: tuple[Callable[..., None], ...] = ()
        self._changing = threading.Lock()

    def add(self, heard: Callable[..., None]) -> Callable[[], None]:
        """Call a function from now on. Return another one that ends that."""
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
    """The last events of a line. One thread adds, any may read."""

    def __init__(self) -> None:
        """None so far."""
        self._kept: tuple[int, tuple[Event, ...]] = (0, ())  # one attribute, so that both are of one moment

    def add(self, events: Sequence[Event]) -> None:
        """They have happened."""
        if events:
            total, last = self._kept
            self._kept = total + len(events), (*last, *events)[-MOST_EVENTS:]

    def bring(self, total: int, newest: Sequence[Event]) -> None:
        """Add the newest of `total` events in all; events in between are unknown."""
        if newest:
            _, last = self._kept
            self._kept = total, (*last, *newest)[-MOST_EVENTS:]

    def after(self, count: int) -> tuple[int, Sequence[Event]]:
        """How many there were so far, and those after so many."""
        total, last = self._kept
        new = min(max(total - count, 0), len(last))
        return total, last[len(last) - new :]


class TickSource:
    """A simulation that one thread steps, as a source.

    That thread hands over the inputs before a tick, and takes a copy of the line after it.
    """

    controls: frozenset[Control] = frozenset()
    """None: whoever steps it decides when."""

    def __init__(self, simulation: Simulation) -> None:
        """Shows it as it is."""
        self._simulation = simulation
        self._waiting: deque[Input] = deque()
        self._listeners = Listeners()
        self._events = RecentEvents()
        image, scene = simulation.process_image, simulation.scene
        self._names = (*image.signal_names, *image.command_names)
        self._signal_names = image.signal_names
        self._about = About(scene.name, scene.where, scene.tick, scene.start_time, image.tags)
        self._alarms, self._read_back = simulation.line.alarms.columns(), simulation.line.read_back.columns()
        self._show()

    @property
    def about(self) -> About:
        """What stays the same."""
        return self._about

    @property
    def shown(self) -> Shown:
        """The line as it was at the end of the last tick."""
        return self._shown

    @property
    def past(self) -> Past | None:
        """Nobody knows."""
        return None

    def events(self, after: int) -> tuple[int, Sequence[Event]]:
        """How many events there were since this source began, and those after so many."""
        return self._events.after(after)

    def listen(self, heard: Callable[[], None]) -> Callable[[], None]:
        """Have a function called after each tick; what is returned ends that."""
        return self._listeners.add(heard)

    def give(self, given: Input) -> str:
        """Have an input judged and applied as the next tick begins. Why it can't wait for that, "" if it does."""
        if len(self._waiting) >= MOST_WAITING:
            return f"{MOST_WAITING} inputs wait for the next tick already"
        self._waiting.append(given)
        return ""

    def control(self, what: Control, value: float, by: str) -> str:
        """Refused."""
        return f"{what}: the test decides when time passes, expected no control of the run"

    def before_tick(self) -> None:
        """Hand over what waits. By the thread that steps."""
        for _ in range(len(self._waiting)):
            self._simulation.give(self._waiting.popleft())

    def after_tick(self) -> None:
        """Show the line as it is now. By the thread that steps."""
        self._look()
        self._show()
        self._listeners.tell()

    @property
    def _run(self) -> RunState:
        return RunState(RUNNING)

    def _look(self) -> None:
        """Take what is told of a tick only if it changed in it."""
        line = self._simulation.line
        self._alarms = line.alarms.changes() or self._alarms
        self._read_back = line.read_back.changes() or self._read_back
        self._events.add(self._simulation.line.happened)

    def _show(self) -> None:
        simulation = self._simulation
        signals = simulation.line.signals()
        values = [*signals.values.tolist(), *simulation.line.read_back.values]
        self._shown = Shown(
            simulation.tick,
            dict(zip(self._names, values, strict=True)),
            frozenset(self._signal_names[place] for place in signals.forced),
            self._run,
            self._read_back,
            self._alarms,
            owner=simulation.line.modes.owner,
            released=tuple(simulation.line.modes.released),
        )
