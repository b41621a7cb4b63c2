# SPDX-License-Identifier: Apache-2.0
"""`Line`: the devices of a scene, and the commands and faults that reach them at ticks."""

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.columns.counters import CounterColumns
from conveyor_sim.columns.damage import DamageEvent
from conveyor_sim.columns.events import Event, Kind
from conveyor_sim.columns.image import Image
from conveyor_sim.line.alarm_system import AlarmSystem
from conveyor_sim.line.alarms.alarms import Alarms
from conveyor_sim.line.commands.authority import MAY, PEOPLE, panel_problem, unauthorized
from conveyor_sim.line.commands.forcing import Forcing
from conveyor_sim.line.commands.inputs import FAULT, INJECT, SET, WATCHDOG, CommandOutcome, Input, normalized
from conveyor_sim.line.commands.modes import Modes
from conveyor_sim.line.commands.operation import Operation
from conveyor_sim.line.commands.placement import BottlePlacement
from conveyor_sim.line.commands.read_back import ReadBack
from conveyor_sim.line.commands.refusal import CommandLimits, moved_belts, refusal, shown
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.device_kinds import build_devices
from conveyor_sim.line.devices.belt_surfaces import BeltSurfaces
from conveyor_sim.line.devices.photo_eye import PhotoEyeDevice
from conveyor_sim.line.devices.setpoint import SetpointDevice
from conveyor_sim.line.idle import CalledDevices
from conveyor_sim.line.machines.counters import RESET_COUNTERS, ProductionCounters
from conveyor_sim.line.run_state import RUN_TAGS
from conveyor_sim.line.tag import PANEL, Adds, ProcessImage
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.state import State
from conveyor_sim.physics.state.snapshot import entries, restore, snapshot, typed
from conveyor_sim.physics.state.state import FIRST_SLOTS
from conveyor_sim.scene.driven import belt_speeds
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.types import Unchecked
from conveyor_sim.support.printable import printable


class EventLog:
    """Collects events since the last tick, in order. Public attributes are stored in checkpoints."""

    events: list[tuple[int, str, str, int, Unchecked, str]]
    """Events since the last tick, as fields of Event."""
    bottles: dict[str, int]
    """Number of bottles that each device has put onto the line or taken off it so far."""
    states: dict[str, list[Unchecked]]
    """States of machines at the end of the last tick, by device."""

    def __init__(self, devices: Sequence[Device], now: ScanContext) -> None:
        """Start without events.

        now: at the start, with the initial states of machines.
        """
        self._machines = [
            (device.name, device.states, states)
            for device in devices
            if (states := [signal for signal in device.signals if signal.adds_to == "state"])
        ]
        self._watched = self._machines
        self.events = []
        self.total = 0
        """Number of events so far."""
        self.bottles = {device.name: 0 for device in devices}
        self.states = {name: [float(value) for value in read(now)] for name, read, _ in self._machines}

    def begin(self) -> None:
        """Start a tick without events."""
        self.events = []

    def leave_out(self, resting: Collection[str]) -> None:
        """Don't read the states of resting devices, by name, which don't change."""
        self._watched = [machine for machine in self._machines if machine[0] not in resting]

    def note(self, at: int, kind: Kind, name: str, value: float, bottle: int = -1, text: str = "") -> None:
        """Add an event."""
        self.events.append(Event(at, kind, name, bottle, value, text))
        self.total += 1

    def note_outcome(self, outcome: CommandOutcome) -> None:
        """Add the event of a refused input, or of a fault."""
        at, names, values = outcome.tick, outcome.names, outcome.values
        if outcome.repeated:
            return
        if not outcome.accepted:
            value = values[0] if len(names) == len(values) == 1 else math.nan
            self.note(at, "command_refused", printable(", ".join(names)), value, text=outcome.reason)
        elif outcome.operation == INJECT:
            self.note(at, "fault_injected" if values[0] else "fault_cleared", names[0], values[0])

    def note_alarm(self, at: int, kind: Kind, name: str, value: float, text: str) -> None:
        """Add an event of an alarm."""
        self.note(at, kind, name, value, text=text)

    def note_removed(self, device: Device, bottles: Sequence[int], now: ScanContext) -> None:
        """Add events of bottles that a device has taken, by their ids."""
        rejects = any(signal.adds_to == "rejected" for signal in device.signals)
        self._note_bottles("bottle_rejected" if rejects else "bottle_removed", device, sorted(bottles), now)

    def note_fed(self, device: Device, first: int, now: ScanContext) -> None:
        """Add events of bottles that a device has fed.

        first: ID of the first bottle that was fed.
        """
        self._note_bottles("bottle_fed", device, range(first, now.state.next_id), now)

    def note_states(self, now: ScanContext) -> None:
        """Add events of changed states at the end of a tick."""
        stored = self.states
        for name, read, states in self._watched:
            before, present = stored[name], read(now)
            if before != present:
                stored[name] = [float(value) for value in present]
                for state, old, value in zip(states, before, present, strict=True):
                    if old != value:
                        text = state.texts.get(int(value), "")
                        self.note(now.tick, "machine_state", state.name, float(value), text=text)

    def _note_bottles(self, kind: Kind, device: Device, bottles: Sequence[int], now: ScanContext) -> None:
        for bottle in bottles:
            self.bottles[device.name] += 1
            self.note(now.tick, kind, device.name, float(self.bottles[device.name]), bottle)


_Outcome = tuple[int, Input, bool, str, bool, bool, bool, tuple[int, ...]]

_REMOVED: tuple[Adds, ...] = ("removed", "rejected")


Reader = Callable[[ScanContext], Sequence[float]]
"""Function that reads the signals of a device, in their order."""


class _Part(NamedTuple):
    """Part of a line whose state lasts from tick to tick, as plain data."""

    snapshot: Callable[[], Any]
    restore: Callable[[int, Any], None]
    """Takes the tick and the data. Raises ValueError for data of another kind."""


class Line:
    """Everything on a line that acts at ticks. Bottle motion is not part of it."""

    def __init__(self, scene: Scene, state: State) -> None:
        """Build the devices of a scene in their initial state."""
        drives = (drive.speed for drive in scene.drives.values())
        speeds = np.array([*belt_speeds(scene).values(), *drives], dtype=np.float64)
        self.now = ScanContext(state, scene.tick, speeds, speeds.copy())
        devices = build_devices(scene, state.model)
        self._log = EventLog(devices, self.now)
        self._pending: list[Input] = []
        self.modes = Modes(devices, scene.where, lambda: self._pending, self._log.note)
        """Control modes of devices, and ownership of the line."""
        self._alarms = AlarmSystem(scene, devices, self.modes, self._log.note_alarm)
        devices = (*devices, self._alarms.device) if devices else devices
        self._devices = devices
        movers = [device for device in devices if isinstance(device, SetpointDevice)]
        self._watched = [mover for mover in movers if mover.watchdog is not None]
        self._eyes = [device for device in devices if isinstance(device, PhotoEyeDevice)]
        self._reading = [device.read for device in devices]
        self._names_read: tuple[str, ...] = ()
        self._devices_read: list[tuple[Reader, list[tuple[str, int]]]] = []
        # Only overridden methods are called.
        self._called = CalledDevices(devices, self._log.leave_out)
        exits = state.model.has("outfeed")
        self._taking = [
            device for device in devices if type(device).take is not Device.take and (exits or not device.takes_bottles)
        ]
        self._feeding = [device for device in devices if type(device).feed is not Device.feed]
        # Devices that count bottles, with the indices of the counting signals.
        self._counting = {
            adds_to: [
                (device, places)
                for device in devices
                if (places := [place for place, signal in enumerate(device.signals) if signal.adds_to == adds_to])
            ]
            for adds_to in ("fed", "removed", "rejected")
        }
        self.takes = bool(self._taking)
        """True if any device takes bottles off the line, or changes what bottles touch."""
        self.feeds = bool(self._feeding) and state.model.has("infeed")
        """True if any device puts bottles onto the line."""
        self._outcomes: list[CommandOutcome] = []
        tags = (tag for device in devices for tag in device.tags)
        self.image = ProcessImage((*tags, *self.modes.signals, *RUN_TAGS))
        self.forcing = Forcing(self.image.signals, self._log.note)
        """Forced signals."""
        self.read_back = ReadBack(
            self.image.commands,
            frozenset(command.name for device in devices if device.takes_repeats for command in device.commands),
        )
        """Present value and writer of each command."""
        self._owner = {entry.name: device for device in devices for entry in (*device.commands, *device.faults)}
        self._commands = {tag.name: tag for tag in self.image.commands}
        self._limits = CommandLimits(self._commands)
        self._panel = frozenset(tag.name for tag in self.image.commands if tag.role == PANEL)
        self._faults = {tag.name: tag for tag in self.image.faults}
        self._moved = moved_belts(self.image.tags)
        objecting = [device for device in devices if type(device).objection is not Device.objection]
        self._objecting = {command.name: device for device in objecting for command in device.commands}
        self._counters = ProductionCounters(devices, scene.counts_starts)
        self.placement = BottlePlacement(state, lambda: self._pending, self._log.note)
        """Bottles that inputs put on the line or remove."""
        self._operations = {
            SET: Operation(self._set_refusal, self._set),
            INJECT: Operation(self._inject_refusal, self._set),
            **self.modes.operations(),
            **self.forcing.operations(),
            **self._alarms.operations(),
            RESET_COUNTERS: Operation(self._counters.refusal, self._counters.reset),
            **self.placement.operations(),
        }
        self._surfaces = BeltSurfaces(state)
        self._parts = {
            "devices": _part("devices", {device.name: device for device in devices}, *devices),
            "log": _part("log", self._log),
            "read_back": _part("read_back", self.read_back, self.read_back),
            "modes": _part("modes", self.modes, self.modes),
            "forcing": _part("forcing", self.forcing, self.forcing),
            "alarms": _Part(self._alarms.snapshot, self._alarms.restore),
            "counters": _part("counters", self._counters.memory),
        }
        self.now.begin_scan()  # because reading states above cached bottle counts of an empty line

    @property
    def fed(self) -> int:
        """Number of bottles put onto the line so far."""
        return sum(count for _, count in self._counted("fed"))

    @property
    def removed(self) -> int:
        """Number of bottles taken off the line so far."""
        return sum(count for kind in _REMOVED for _, count in self._counted(kind))

    def removed_by(self) -> dict[str, int]:
        """Return the number of bottles taken off the line so far, by device."""
        by: dict[str, int] = {}
        for kind in _REMOVED:
            for name, count in self._counted(kind):
                by[name] = by.get(name, 0) + count
        return by

    @property
    def blocked_ticks(self) -> int:
        """Number of ticks so far in which a device had a bottle to feed and no room."""
        return sum(device.blocked_ticks for device in self._devices)

    @property
    def fastest_surface(self) -> float:
        """Speed of the fastest point of any belt, m/s."""
        return self._surfaces.fastest

    def move_belts(self) -> None:
        """Set the surface speeds of all belts to the present speeds."""
        self._surfaces.move(self.now.belt_speeds)

    def queue(self, request: Input) -> None:
        """Queue an input for the start of the next tick."""
        self._pending.append(normalized(request))

    @property
    def operations(self) -> tuple[str, ...]:
        """Names of the operations on the line."""
        return tuple(self._operations)

    @property
    def waiting(self) -> Sequence[Input]:
        """Inputs that wait for the next tick."""
        return tuple(self._pending)

    def take_waiting(self) -> list[Input]:
        """Remove and return the inputs that wait for the next tick."""
        waiting, self._pending = self._pending, []
        return waiting

    def refusal(self, request: Input) -> str:
        """Return why an input can't be applied now, "" if it can."""
        return self._refusal(normalized(request))

    def _refusal(self, request: Input) -> str:
        if reason := unauthorized(request, self._operations):
            return reason
        _, rest, reason = self.modes.divide(request)
        return reason if rest is None else self._operations[request.operation].refusal(rest)

    def _set_refusal(self, request: Input) -> str:
        names, values = request.names, request.values
        if reason := _with_texts(request):
            return reason
        if not self._limits.admit(names, values) and (
            reason := refusal(self._commands, "command", names, values, self._moved)
        ):
            return reason
        if self._panel and (reason := panel_problem(request, self._panel)):
            return reason
        for name, value in zip(names, values, strict=True) if self._objecting else ():
            if name in self._objecting and (reason := self._objecting[name].objection(name, value, self.now)):
                return reason
        return self._alarms.report_problem(names, values)

    def _inject_refusal(self, request: Input) -> str:
        return _with_texts(request) or refusal(self._faults, FAULT, request.names, request.values, self._moved)

    def _set(self, request: Input, now: ScanContext) -> None:
        by_hand = self.modes.stops_by_hand(request)
        now.by_hand = request.writer_kind in PEOPLE
        if now.by_hand:
            commands = list(zip(request.names, request.values, strict=True))
        else:
            commands = self.read_back.changed(request)
        for name, value in commands:
            if name in by_hand:
                self._owner[name].stop_by_hand(name, value)
            elif name in self._owner:  # not an alarm
                self._owner[name].command(name, value, now)
        self.read_back.note_values((request.writer, request.writer_kind), commands, now.tick)

    def take_outcomes(self) -> list[CommandOutcome]:
        """Return the results of inputs since the last call, in order."""
        outcomes, self._outcomes = self._outcomes, []
        return outcomes

    def begin(self, tick: int) -> None:
        """Apply queued inputs, then let devices act before the steps that start from a tick."""
        self._at(tick)
        self._log.begin()
        self.read_back.begin()
        self._alarms.begin()
        pending, self._pending = self._pending, []
        for request in pending:
            foreign, rest, objection = self.modes.divide(request)
            if foreign is not None:
                repeated = not self.modes.report(foreign)
                self._note(CommandOutcome(tick, foreign, False, objection, True, rest is not None, repeated))
            if rest is not None:
                reason = self._refusal(rest)
                if not reason:
                    self._operations[rest.operation].apply(rest, self.now)
                self._note(CommandOutcome(tick, rest, not reason, reason, bottles=self.placement.take_added()))
            if request.operation == SET and request.writer_kind in MAY[SET].writers:  # even if refused
                self._alarms.report(tick, request.names, request.values)
        self.placement.end(self.now)
        for mover in self._watched:
            if name := mover.watch(self.now):
                stopped = Input(WATCHDOG, WATCHDOG, "line", SET, (name,), (0.0,))
                self._outcomes.append(CommandOutcome(tick, stopped, True, ""))
                self.read_back.note(stopped, tick)
                self._log.note(tick, "machine_state", name, 0.0, text="stopped: its watchdog received no command")
        before = self.now.speeds.tolist()
        self._called.begin(self.now)
        self._alarms.take(self.now)
        if before != self.now.speeds.tolist():
            self.move_belts()

    def end(self, tick: int) -> None:
        """Let the devices evaluate the steps up to a tick."""
        self._at(tick)
        self._called.end(self.now)
        if tick == 0:
            self._alarms.take(self.now)

    def rehearse(self) -> None:
        """Call engine functions that devices may need in later ticks, so that they are compiled before a run begins."""
        for device in self._devices:
            device.rehearse(self.now)

    def take(self) -> None:
        """Let the devices take bottles off the line."""
        for device in self._taking:
            device.take(self.now)
            if removed := self.now.state.take_removed():
                self._log.note_removed(device, removed, self.now)
                self._counters.line.note_removed(device, removed, self.now.bad)
                self.now.forget(removed)
        self.now.begin_scan()

    def feed(self) -> None:
        """Let the devices put bottles onto the line."""
        for device in self._feeding:
            first = self.now.state.next_id
            device.feed(self.now)
            if self.now.state.next_id > first:
                self._log.note_fed(device, first, self.now)
        self.now.begin_scan()

    def close(self, passed: Sequence[DamageEvent], clogged: Mapping[str, bool]) -> None:
        """End a tick.

        passed: load limits exceeded in the tick. clogged: True if clogged, by name of the monitored outfeeds.
        """
        for limit in passed:
            self._log.note(limit.tick, "limit_passed", limit.kind, limit.value, limit.bottle, limit.text)
        self._log.note_states(self.now)
        self._called.review(self.now)
        forced = {name: value for name, value, _ in self.forcing.forces} if self.forcing.forces else {}
        self._alarms.close(self.now, passed, clogged, forced)

    @property
    def happened(self) -> Sequence[Event]:
        """Events since the last tick, in order."""
        return tuple(Event(*event) for event in self._log.events)

    @property
    def happened_so_far(self) -> int:
        """Number of events since the start."""
        return self._log.total

    @property
    def alarms(self) -> Alarms:
        """All alarms of the line."""
        return self._alarms.alarms

    def signals(self) -> Image:
        """Return the values of all signals, in the order of the process image."""
        self.now.begin_scan()
        values = [value for read in self._reading for value in read(self.now)]
        return self.forcing.image(np.array(values + self.modes.values, dtype=np.float64))

    def values_of(self, names: tuple[str, ...]) -> dict[str, float]:
        """Return the values of some signals as controllers read them. Other devices are not read.

        Raises KeyError for a name that is no signal.
        """
        if names != self._names_read:
            self._names_read, self._devices_read = names, self._readers_of(names)
        self.now.begin_scan()
        values: dict[str, float] = {}
        for read, columns in self._devices_read:
            row = read(self.now)
            for name, column in columns:
                values[name] = float(row[column])
        for name, value, _ in self.forcing.forces:
            if name in values:
                values[name] = value
        return values

    def _readers_of(self, names: Sequence[str]) -> list[tuple[Reader, list[tuple[str, int]]]]:
        """Return the functions that read the devices of some signals, with these signals and their places."""
        sources: list[Device | Modes] = [*self._devices, self.modes]
        places = {tag.name: (source, place) for source in sources for place, tag in enumerate(source.signals)}
        columns: dict[Device | Modes, list[tuple[str, int]]] = {}
        for name in names:
            source, place = places[name]
            columns.setdefault(source, []).append((name, place))
        return [(source.read, chosen) for source, chosen in columns.items()]

    def counters(self) -> CounterColumns | None:
        """Return production counts and times since the last reset; None if no device counts."""
        return self._counters.columns(self.now.tick, self.now.length)

    def photo_eyes(self) -> dict[str, bool]:
        """Return whether each photo-eye is blocked, as controllers read it, by device name."""
        eyes = {eye.name: eye.blocked for eye in self._eyes}
        if self.forcing.forces:
            return {name: self.forcing.read(f"{name}/blocked", float(on)) != 0.0 for name, on in eyes.items()}
        return eyes

    def carriers(self) -> NDArray[np.int32]:
        """Return the index of the belt under each slot, (slots,); -1 for floor, plates and free slots."""
        self.now.begin_scan()
        return self.now.carriers()

    def restore_from(self, other: "Line") -> None:
        """Take over the state of another line of the same scene, except waiting inputs and unread command results."""
        own = self.snapshot()
        self.restore(other.now.tick, {**other.snapshot(), "pending": own["pending"], "outcomes": own["outcomes"]})

    def snapshot(self) -> dict[str, Any]:
        """Return all state that lasts from tick to tick, as plain data."""
        return {
            "pending": [tuple(request) for request in self._pending],
            "outcomes": [
                tuple(getattr(outcome, field.name) for field in fields(outcome)) for outcome in self._outcomes
            ],
            "setpoints": self.now.setpoints.tolist(),
            "speeds": self.now.speeds.tolist(),
            "bad": sorted(self.now.bad),
            "attributes": {name: list(values.items()) for name, values in self.now.attributes.items()},
            **{name: part.snapshot() for name, part in self._parts.items()},
        }

    def restore(self, tick: int, memory: dict[str, Any]) -> None:
        """Restore the state at a tick from what `snapshot` returned. Raise ValueError for any other data."""
        entries(memory, self.snapshot(), "line")
        self.now.tick = tick
        self._pending = typed(list[Input], memory["pending"], "line.pending")
        self._outcomes = [
            CommandOutcome(*entry) for entry in typed(list[_Outcome], memory["outcomes"], "line.outcomes")
        ]
        speeds = {"setpoints": self.now.setpoints, "speeds": self.now.speeds}
        restore(speeds, {name: memory[name] for name in speeds}, "line")
        self._surfaces.note(self.now.belt_speeds)
        self.now.bad = set(typed(list[int], memory["bad"], "line.bad"))
        attributes = typed(dict[str, list[tuple[int, float]]], memory["attributes"], "line.attributes")
        self.now.attributes = {name: dict(values) for name, values in attributes.items()}
        for name, part in self._parts.items():
            part.restore(tick, memory[name])
        self._called.wake_all()

    @property
    def held(self) -> list[int]:
        """Ids of the bottles that devices hold off the line and will give back, in order."""
        return sorted(bottle for device in self._devices for bottle in device.held)

    def _note(self, outcome: CommandOutcome) -> None:
        if not outcome.accepted:
            outcome = replace(outcome, input=outcome.input._replace(names=shown(outcome.names)))
        self._outcomes.append(outcome)
        self._log.note_outcome(outcome)

    def _counted(self, adds_to: Adds) -> Iterator[tuple[str, int]]:
        """Yield devices, with the sums of their signals that add to `adds_to`."""
        for device, places in self._counting[adds_to]:
            values = device.read(self.now)
            yield device.name, sum([int(values[place]) for place in places])

    def _at(self, tick: int) -> None:
        self.now.tick = tick
        self.now.begin_scan()


def _with_texts(request: Input) -> str:
    return f"{len(request.texts)} texts given, expected none" if request.texts else ""


def _part(name: str, part: Any, *waking: Device | ReadBack | Modes | Forcing) -> _Part:
    """Return a part that is stored by its public attributes. waking: objects to be notified after a restore."""

    def put_back(tick: int, memory: Any) -> None:
        restore(part, memory, f"line.{name}")
        for one in waking:
            one.restored(tick)

    return _Part(lambda: snapshot(part), put_back)


def image_of(scene: Scene) -> ProcessImage:
    """Return the process image of a scene without running it. Raise SceneError for an invalid scene."""
    return Line(scene, State(build_model(scene), FIRST_SLOTS)).image
