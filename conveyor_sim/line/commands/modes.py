"""`Modes`: in whose hands each device is, and which controller owns the line."""

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
from conveyor_sim.line.commands.refusal import refusal
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.tag import Tag, choice
from conveyor_sim.support.printable import SENTENCE, printable

_REASONS = 3
"""Of as many devices a refusal says why."""

_HANDS = (MODE, OWN, DISOWN)
"""Operations that change hands."""


class Modes:
    """The mode of each device that takes commands. Public attributes are remembered in checkpoints."""

    modes: dict[str, int]
    """By device."""
    taken_by: dict[str, str]
    """By device, who has put it into its mode: "operator Jo"; "": it began so."""
    owner: str
    """The controller that owns the line; "": none does, and any may command."""
    released: list[str]
    """Patterns of devices that the owner leaves to others."""
    reported: list[str]
    """"device:kind" of refusals for want of control that are reported already, since hands last changed."""

    def __init__(
        self, devices: Sequence[Device], where: str, waiting: Callable[[], Sequence[Input]], note: Callable[..., None]
    ) -> None:
        """devices: of a line; those that take commands begin in automatic. where: the line's place in the plant.
        waiting: what will be applied before whatever is asked about. note: as EventLog.note.
        """
        commanded = [device for device in devices if device.commands]
        self._devices = {device.name: device for device in commanded}
        self._where = where
        self._waiting = waiting
        self._note = note
        self._device_of = {command.name: device.name for device in commanded for command in device.commands}
        self._tags = tuple(_tag(device) for device in commanded)
        self._table = {tag.device: tag for tag in self._tags}
        self.modes = {device.name: AUTOMATIC for device in commanded}
        self.taken_by = dict.fromkeys(self.modes, "")
        self.owner = ""
        self.released = []
        self.reported = []
        self._look()
        self._free = self._found_free()

    @property
    def signals(self) -> tuple[Tag, ...]:
        """`<device>/mode`, one for each."""
        return self._tags

    @property
    def read(self) -> Callable[[ScanContext], list[float]]:
        """What gives their values."""
        return lambda now: self._values

    @property
    def values(self) -> list[float]:
        """Their values."""
        return self._values

    def operations(self) -> dict[str, Operation]:
        """What changes hands, by name."""
        row = Operation(lambda given: self.later()._problem(given), self._change)
        return dict.fromkeys(_HANDS, row)

    def divide(self, given: Input) -> tuple[Input | None, Input | None, str]:
        """What of an input its writer has no control of, and what is left; why the former is refused.

        A controller commands in one input all that it works, so what is in other hands is taken out of it. Of others
        the whole is refused.
        """
        if given.operation != SET or len(given.names) != len(given.values):
            return None, given, ""
        kind, quiet = given.writer_kind, self._all_automatic and not self._waiting()
        if kind == "test" or kind not in WRITER_KINDS or (quiet and kind == "controller" and self._is_free(given)):
            return None, given, ""
        later = self.later()
        freely = self._stops(given)
        devices = {
            name: self._device_of[name] for name in given.names if name in self._device_of and name not in freely
        }
        objections = {device: later._objection(given, device) for device in dict.fromkeys(devices.values())}
        foreign = [index for index, name in enumerate(given.names) if objections.get(devices.get(name, ""))]
        if not foreign:
            return None, given, ""
        reasons = [reason for reason in objections.values() if reason]
        more = f"; and {len(reasons) - _REASONS} other devices" if len(reasons) > _REASONS else ""
        reason = "; ".join(reasons[:_REASONS]) + more
        own = [index for index in range(len(given.names)) if index not in set(foreign)]
        if kind != "controller" or not own:
            return given, None, reason
        return _of(given, foreign), _of(given, own), reason

    def stops_by_hand(self, given: Input) -> Collection[str]:
        """Commands of an input by which a person stops what is in other hands."""
        return [name for name in self._stops(given) if self._objection(given, self._device_of[name])]

    def pattern_problem(self, patterns: Sequence[str]) -> str:
        """Why groups of devices can't be released by these patterns, "" if they can."""
        return pattern_problem(patterns, self.modes, self._where)

    def later(self) -> Modes:
        """As it will be once what waits has been applied."""
        changes = [given for given in self._waiting() if given.operation in _HANDS]
        if not changes:
            return self
        later = copy(self)
        later.modes, later.taken_by = dict(self.modes), dict(self.taken_by)
        for given in changes:
            if not unauthorized(given, _HANDS) and not later._problem(given):
                later._apply(given)
        return later

    def report(self, given: Input) -> bool:
        """Whether a refusal for want of control says something new: to this kind of writer, of one of its devices."""
        entries = {f"{self._device_of[name]}:{given.writer_kind}" for name in given.names if name in self._device_of}
        new = sorted(entries.difference(self.reported))
        self.reported += new
        return bool(new)

    def restored(self, tick: int) -> None:
        """Check the restored attributes. Raise ValueError if they do not fit the line."""
        known = {f"{device}:{kind}" for device in self.modes for kind in WRITER_KINDS}
        if any(mode not in MODES for mode in self.modes.values()) or not known.issuperset(self.reported):
            raise ValueError("line.modes has a mode or a device that there is not")
        texts = (self.owner, *self.released, *self.taken_by.values())
        if any(text != printable(text, SENTENCE) for text in texts) or self.pattern_problem(self.released):
            raise ValueError("line.modes has texts that can't be")
        self._look()
        self._free = self._found_free()

    @property
    def _owned(self) -> str:
        return f"the line is owned by controller {printable(self.owner)}"

    def _objection(self, given: Input, device: str) -> str:
        mode, kind = self.modes[device], given.writer_kind
        if kind not in IN_CONTROL[mode]:
            taken = f", taken by {self.taken_by[device]}" if self.taken_by[device] else ""
            modes = " or ".join(text for number, text in MODES.items() if kind in IN_CONTROL[number])
            article = "a" if kind == "controller" else "an"
            return f"{device}: is in {MODES[mode]}{taken}, expected {modes} for {article} {kind}'s commands"
        if kind != "controller" or self._is_free(given):
            return ""
        return "" if device in self._free else f"{device}: {self._owned}, expected its release"

    def _stops(self, given: Input) -> Collection[str]:
        """Commands of an input that stop devices, and may be given in any mode: if a person gives them."""
        if given.writer_kind not in PEOPLE:
            return ()
        own = ((name, value) for name, value in zip(given.names, given.values, strict=True) if name in self._device_of)
        return [name for name, value in own if self._devices[self._device_of[name]].stops(name, value)]

    def _is_free(self, given: Input) -> bool:
        """Whether no other controller than the writer owns the line."""
        return self.owner in ("", given.writer)

    def _problem(self, given: Input) -> str:
        if given.operation == MODE:
            return self._mode_problem(given)
        if reason := hand_over_problem(given):
            return reason
        if not self._is_free(given):
            return f"{self._owned}, expected its release"
        if given.operation == DISOWN:
            return "" if self.owner else "the line has no owner, expected one"
        return self.pattern_problem(given.texts)

    def _mode_problem(self, given: Input) -> str:
        if given.texts:
            return f"{len(given.texts)} texts given, expected none"
        if reason := refusal(self._table, "device", given.names, given.values):
            return reason
        for device, value in zip(given.names, given.values, strict=True):
            wrong = reserved_mode(given.writer_kind, (value, self.modes[device]))
            if wrong is not None:
                return reserved(device, given.writer_kind, wrong)
            if value != self.modes[device] and (reason := self._devices[device].mode_objection()):
                return f"{device}: {reason}"
        return ""

    def _change(self, given: Input, now: ScanContext) -> None:
        if given.operation == MODE:
            for device in self._apply(given):
                self._devices[device].take_mode(self.modes[device], now)
                self._note(now.tick, "mode_changed", device, float(self.modes[device]), text=f"by {who(given)}")
        else:
            self._apply(given)
            text = f"released: {', '.join(self.released)}" if self.released else ""
            self._note(now.tick, "owner_changed", given.writer, float(given.operation == OWN), text=text)

    def _apply(self, given: Input) -> list[str]:
        """Do what there is nothing against; the devices whose mode has changed."""
        changed = []
        if given.operation == MODE:
            for device, value in zip(given.names, given.values, strict=True):
                if self.modes[device] != value:
                    changed.append(device)
                    self.modes[device], self.taken_by[device] = int(value), who(given)
            self.reported = [entry for entry in self.reported if entry.partition(":")[0] not in changed]
        else:
            self.owner = given.writer if given.operation == OWN else ""
            self.released = list(given.texts)
            self._free = self._found_free()
            self.reported = []
        self._look()
        return changed

    def _found_free(self) -> frozenset[str]:
        """The devices that the owner leaves to others."""
        patterns = self.released
        return frozenset(
            device for device in self.modes if any(covers(pattern, device, self._where) for pattern in patterns)
        )

    def _look(self) -> None:
        self._values = [float(self.modes[tag.device]) for tag in self._tags]
        self._all_automatic = all(mode == AUTOMATIC for mode in self.modes.values())


def _of(given: Input, chosen: Sequence[int]) -> Input:
    names, values = tuple(given.names[index] for index in chosen), tuple(given.values[index] for index in chosen)
    return given._replace(names=names, values=values)


def _tag(device: Device) -> Tag:
    tag = choice(f"{device.name}/mode", "status", "In whose hands it is.", MODES, AUTOMATIC)
    return replace(tag, device=device.name, device_class=device.tags[0].device_class)
