# SPDX-License-Identifier: Apache-2.0
"""`Modes`: control mode of each device, and the controller that owns the line."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from copy import copy
from dataclasses import replace

from conveyor_sim.line.commands.authority import (
    AUTOMATIC,
    IN_CONTROL,
    MODES,
    PEOPLE,
    covers,
    hand_over_problem,
    pattern_problem,
    reserved,
    reserved_mode,
    unauthorized,
    who,
)
from conveyor_sim.line.commands.inputs import DISOWN, MODE, OWN, SET, WRITER_KINDS, Input
from conveyor_sim.line.commands.operation import Operation
from conveyor_sim.line.commands.refusal import moved_belts, refusal
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.tag import CONTROLLED, Tag, choice, of_roles
from conveyor_sim.support.printable import SENTENCE, printable

_REASONS = 3
"""Largest number of devices for which a refusal lists reasons."""

_AUTHORITY = (MODE, OWN, DISOWN)
"""Operations that change control authority."""


class Modes:
    """Control modes of all devices that take commands, and ownership. Public attributes are stored in checkpoints."""

    modes: dict[str, int]
    """Control mode by device."""
    taken_by: dict[str, str]
    """Writer that set the mode, by device: "operator Jo"; "" for the mode at the start."""
    owner: str
    """Controller that owns the line; "" if any controller may command."""
    released: list[str]
    """Patterns of devices that the owner leaves to others."""
    reported: list[str]
    """"device:kind" of refusals for lack of control authority that were reported since authority last changed."""

    def __init__(
        self, devices: Sequence[Device], where: str, waiting: Callable[[], Sequence[Input]], note: Callable[..., None]
    ) -> None:
        """Start with all devices in Automatic and no owner.

        devices: all devices of the line. where: the line's place in the plant. waiting: returns inputs that will be
        applied first. note: as EventLog.note.
        """
        controlled = {device.name: of_roles(device.commands, CONTROLLED) for device in devices}
        commanded = [device for device in devices if controlled[device.name]]
        self._devices = {device.name: device for device in commanded}
        self._where = where
        self._waiting = waiting
        self._note = note
        self._device_of = {command.name: device.name for device in commanded for command in controlled[device.name]}
        self._tags = tuple(_tag(device) for device in commanded)
        self._table = {tag.device: tag for tag in self._tags}
        self._moved = moved_belts([tag for device in devices for tag in device.tags])
        self.modes = {device.name: AUTOMATIC for device in commanded}
        self.taken_by = dict.fromkeys(self.modes, "")
        self.owner = ""
        self.released = []
        self.reported = []
        self._update()
        self._free_devices = self._released_devices()

    @property
    def signals(self) -> tuple[Tag, ...]:
        """`<device>/mode`, one per device that takes commands."""
        return self._tags

    @property
    def read(self) -> Callable[[ScanContext], list[float]]:
        """Function that reads all modes."""
        return lambda now: self._values

    @property
    def values(self) -> list[float]:
        """Modes in the order of `signals`."""
        return self._values

    def operations(self) -> dict[str, Operation]:
        """Return the operations that change control authority, by name."""
        row = Operation(lambda request: self.later()._problem(request), self._change)
        return dict.fromkeys(_AUTHORITY, row)

    def divide(self, request: Input) -> tuple[Input | None, Input | None, str]:
        """Return the part of an input without control authority, the part with it, and why the former is refused.

        A controller sends all its commands in one input, so only commands without authority are taken out. An input of
        any other writer is refused as a whole.
        """
        if request.operation != SET or len(request.names) != len(request.values):
            return None, request, ""
        kind, quiet = request.writer_kind, self._all_automatic and not self._waiting()
        if kind == "test" or kind not in WRITER_KINDS or (quiet and kind == "controller" and self._is_free(request)):
            return None, request, ""
        later = self.later()
        freely = self._stops(request)
        devices = {
            name: self._device_of[name] for name in request.names if name in self._device_of and name not in freely
        }
        objections = {device: later._objection(request, device) for device in dict.fromkeys(devices.values())}
        foreign = [index for index, name in enumerate(request.names) if objections.get(devices.get(name, ""))]
        if not foreign:
            return None, request, ""
        reasons = [reason for reason in objections.values() if reason]
        more = f"; and {len(reasons) - _REASONS} other devices" if len(reasons) > _REASONS else ""
        reason = "; ".join(reasons[:_REASONS]) + more
        own = [index for index in range(len(request.names)) if index not in set(foreign)]
        if kind != "controller" or not own:
            return request, None, reason
        return _of(request, foreign), _of(request, own), reason

    def stops_by_hand(self, request: Input) -> Collection[str]:
        """Return commands by which a person stops devices that are not under that person's control."""
        return [name for name in self._stops(request) if self._objection(request, self._device_of[name])]

    def pattern_problem(self, patterns: Sequence[str]) -> str:
        """Return why these patterns can't release groups of devices, "" if they can."""
        return pattern_problem(patterns, self.modes, self._where)

    def later(self) -> Modes:
        """Return the modes after all waiting inputs have been applied."""
        changes = [request for request in self._waiting() if request.operation in _AUTHORITY]
        if not changes:
            return self
        later = copy(self)
        later.modes, later.taken_by = dict(self.modes), dict(self.taken_by)
        for request in changes:
            if not unauthorized(request, _AUTHORITY) and not later._problem(request):
                later._apply(request)
        return later

    def report(self, request: Input) -> bool:
        """Record a refusal. Return True if it is the first for this kind of writer at one of the devices."""
        devices = {self._device_of[name] for name in request.names if name in self._device_of}
        entries = {f"{device}:{request.writer_kind}" for device in devices}
        new = sorted(entries.difference(self.reported))
        self.reported += new
        return bool(new)

    def restored(self, tick: int) -> None:
        """Check the restored attributes. Raise ValueError if they do not fit the line."""
        known = {f"{device}:{kind}" for device in self.modes for kind in WRITER_KINDS}
        if any(mode not in MODES for mode in self.modes.values()) or not known.issuperset(self.reported):
            raise ValueError("line.modes has an unknown mode or device")
        texts = (self.owner, *self.released, *self.taken_by.values())
        if any(text != printable(text, SENTENCE) for text in texts) or self.pattern_problem(self.released):
            raise ValueError("line.modes has invalid texts")
        self._update()
        self._free_devices = self._released_devices()

    @property
    def _owned(self) -> str:
        return f"the line is owned by controller {printable(self.owner)}"

    def _objection(self, request: Input, device: str) -> str:
        mode, kind = self.modes[device], request.writer_kind
        if kind not in IN_CONTROL[mode]:
            taken = f", taken by {self.taken_by[device]}" if self.taken_by[device] else ""
            modes = " or ".join(text for number, text in MODES.items() if kind in IN_CONTROL[number])
            article = "a" if kind == "controller" else "an"
            return f"{device}: is in {MODES[mode]}{taken}, expected {modes} for {article} {kind}'s commands"
        if kind != "controller" or self._is_free(request):
            return ""
        return "" if device in self._free_devices else f"{device}: {self._owned}, expected its release"

    def _stops(self, request: Input) -> Collection[str]:
        """Return a person's commands that stop devices. They are accepted in any mode."""
        if request.writer_kind not in PEOPLE:
            return ()
        device_of = {name: self._devices[self._device_of[name]] for name in request.names if name in self._device_of}
        commands = zip(request.names, request.values, strict=True)
        return [name for name, value in commands if name in device_of and device_of[name].stops(name, value)]

    def _is_free(self, request: Input) -> bool:
        """Return True if no controller other than the writer owns the line."""
        return self.owner in ("", request.writer)

    def _problem(self, request: Input) -> str:
        if request.operation == MODE:
            return self._mode_problem(request)
        if reason := hand_over_problem(request):
            return reason
        if not self._is_free(request):
            return f"{self._owned}, expected its release"
        if request.operation == DISOWN:
            return "" if self.owner else "the line has no owner, expected one"
        return self.pattern_problem(request.texts)

    def _mode_problem(self, request: Input) -> str:
        if request.texts:
            return f"{len(request.texts)} texts given, expected none"
        if reason := refusal(self._table, "device", request.names, request.values, self._moved):
            return reason
        for device, value in zip(request.names, request.values, strict=True):
            wrong = reserved_mode(request.writer_kind, (value, self.modes[device]))
            if wrong is not None:
                return reserved(device, request.writer_kind, wrong)
            if value != self.modes[device] and (reason := self._devices[device].mode_objection()):
                return f"{device}: {reason}"
        return ""

    def _change(self, request: Input, now: ScanContext) -> None:
        if request.operation == MODE:
            for device in self._apply(request):
                self._devices[device].take_mode(self.modes[device], now)
                self._note(now.tick, "mode_changed", device, float(self.modes[device]), text=f"by {who(request)}")
        else:
            self._apply(request)
            text = f"released: {', '.join(self.released)}" if self.released else ""
            self._note(now.tick, "owner_changed", request.writer, float(request.operation == OWN), text=text)

    def _apply(self, request: Input) -> list[str]:
        """Apply an accepted change, and return the devices whose mode has changed."""
        changed = []
        if request.operation == MODE:
            for device, value in zip(request.names, request.values, strict=True):
                if self.modes[device] != value:
                    changed.append(device)
                    self.modes[device], self.taken_by[device] = int(value), who(request)
            self.reported = [entry for entry in self.reported if entry.partition(":")[0] not in changed]
        else:
            self.owner = request.writer if request.operation == OWN else ""
            self.released = list(request.texts)
            self._free_devices = self._released_devices()
            self.reported = []
        self._update()
        return changed

    def _released_devices(self) -> frozenset[str]:
        """Return the devices that the owner leaves to others."""
        patterns = self.released
        return frozenset(
            device for device in self.modes if any(covers(pattern, device, self._where) for pattern in patterns)
        )

    def _update(self) -> None:
        self._values = [float(self.modes[tag.device]) for tag in self._tags]
        self._all_automatic = all(mode == AUTOMATIC for mode in self.modes.values())


def _of(request: Input, chosen: Sequence[int]) -> Input:
    names, values = tuple(request.names[index] for index in chosen), tuple(request.values[index] for index in chosen)
    return request._replace(names=names, values=values)


def _tag(device: Device) -> Tag:
    tag = choice(f"{device.name}/mode", "status", "Control mode.", MODES, AUTOMATIC)
    return replace(tag, device=device.name, device_class=device.tags[0].device_class)
