# SPDX-License-Identifier: Apache-2.0
"""Reasons for refusing commands and faults: unknown name, wrong value, outside the limits."""

import math
import re
from collections.abc import Mapping, Sequence

from conveyor_sim.line.tag import Tag
from conveyor_sim.scene.parts.alarm import PREFIX
from conveyor_sim.support.printable import printable

_TEXT = "Speed of the surface, {ratio:g} times {drive}/speed."
_PATTERN = re.compile(r"Speed of the surface, \S+ times ((?:drives|axes)/\w+)/speed\.")


def moved_text(drive: str, ratio: float) -> str:
    """Return the description of the speed of a belt that a drive ("drives/m1") or an axis ("axes/a") moves."""
    return _TEXT.format(drive=drive, ratio=ratio)


def moved_belts(tags: Sequence[Tag]) -> dict[str, str]:
    """Return the drive or axis of each belt that one moves: {"belts/one": "drives/m1"}."""
    matches = ((tag.device, _PATTERN.fullmatch(tag.description)) for tag in tags if tag.device_class == "belt")
    return {belt: match[1] for belt, match in matches if match is not None}


ALARMS = PREFIX
"""Prefix of the name of a controller's alarm in an input, with value 0 or 1. It is not a command."""

LISTED = 20
"""Largest number of known names that a refusal lists."""


def refusal(
    known: Mapping[str, Tag],
    what: str,
    names: Sequence[str],
    values: Sequence[float],
    moved: Mapping[str, str] | None = None,
) -> str:
    """Return why a set of inputs can't be applied, "" if it can.

    known: tags by name. what: the word for one of them. moved: drives of belts (`moved_belts`).
    """
    if len(names) != len(values):
        return f"{len(names)} names and {len(values)} values given, expected the same number of both"
    if not names:
        return f"no name and no value given, expected at least one {what}"
    seen: set[str] = set()
    for name, value in zip(names, values, strict=True):
        command = known.get(name)
        if command is None:
            if not name.startswith(ALARMS) or what != "command":
                reason = _of_drive(name, known, what, moved) if moved else ""
                return reason or f"{printable(name)}: no such {what}, expected {_listed(list(known))}"
            if wrong := alarm_problem(name, value):
                return wrong
            continue
        if name in seen:
            return f"{name}: given twice"
        seen.add(name)
        if command.kind == "bool" and value not in (0.0, 1.0):
            return f"{name}: {value:g} given, expected 0 or 1"
        if command.kind in ("count", "enumeration") and not float(value).is_integer():
            limits = "" if math.isinf(command.low) else f" from {command.low:g} to {command.high:g}"
            return f"{name}: {value:g} given, expected a whole number{limits}"
        unit = "" if command.unit == "1" else f" {command.unit}"
        if not math.isfinite(value) or not command.low <= value <= command.high:
            limits = "a finite number" if math.isinf(command.low) else f"{command.low:g} to {command.high:g}{unit}"
            return f"{name}: {value:g} given, expected {limits}"
    return ""


class CommandLimits:
    """Fast check of commands. It accepts fewer of them than `refusal`, which has the reasons."""

    def __init__(self, known: Mapping[str, Tag]) -> None:
        """known: as for `refusal`."""
        self._known = known
        self._names: tuple[str, ...] = ()
        self._limits: list[tuple[bool, float, float]] | None = None

    def admit(self, names: tuple[str, ...], values: Sequence[float]) -> bool:
        """Return True if `refusal` is certain to return "" for a set of commands."""
        if names != self._names:
            self._names, self._limits = names, self._of(names)
        if self._limits is None or len(values) != len(names):
            return False
        for (whole, low, high), value in zip(self._limits, values, strict=True):
            if not low <= value <= high or (whole and value % 1.0):
                return False
        return True

    def _of(self, names: tuple[str, ...]) -> list[tuple[bool, float, float]] | None:
        """Return for each command whether it is a whole number, and its finite limits; None if one has no such limits.

        A controller repeats its names in every scan.
        """
        tags = [self._known.get(name) for name in names]
        if not names or len(set(names)) < len(names):
            return None
        limits = []
        for tag in tags:
            if tag is None or not math.isfinite(tag.high - tag.low):
                return None
            low, high = (0.0, 1.0) if tag.kind == "bool" else (tag.low, tag.high)
            limits.append((tag.kind != "number", low, high))
        return limits


def alarm_problem(name: str, value: float) -> str:
    """Return why a controller can't set or clear an alarm, "" if it can."""
    if name == ALARMS:
        return f"{name}: given, expected {name} and the name of an alarm"
    return "" if value in (0.0, 1.0) else f"{printable(name)}: {value:g} given, expected 0 or 1"


def shown(names: Sequence[str]) -> tuple[str, ...]:
    """Return names from a client, escaped and shortened for display in a command result."""
    return tuple(map(printable, names))


def _of_drive(name: str, known: Mapping[str, Tag], what: str, moved: Mapping[str, str]) -> str:
    """Return the refusal of a tag of a belt that a named drive moves; "" for other names."""
    field, _, rest = name.partition("/")
    belt, _, tag = rest.partition("/")
    drive = moved.get(f"{field}/{belt}")
    if drive is None:
        return ""
    of_drive = f"{drive}/{tag}" if tag else drive
    expected = of_drive if of_drive in known else f"one of {drive}"
    return f"{printable(name)}: no such {what}, as {drive} moves this belt, expected {expected}"


def _listed(known: Sequence[str]) -> str:
    if not known:
        return "none: the line has none"
    others = f" and {len(known) - LISTED} others" if len(known) > LISTED else ""
    return f"one of {', '.join(known[:LISTED])}{others}"
