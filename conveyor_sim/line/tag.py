"""`Tag`: what there is to know of one value of a line, whether it is read, written, or injected by a test."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple


class UnitOfMeasure(NamedTuple):
    """A unit."""

    code: str
    """The common code of UNECE Recommendation 20."""
    name: str
    """As it is called there."""


UNITS: Mapping[str, UnitOfMeasure] = {
    "1": UnitOfMeasure("C62", "one"),
    "m": UnitOfMeasure("MTR", "metre"),
    "m/s": UnitOfMeasure("MTS", "metre per second"),
    "s": UnitOfMeasure("SEC", "second"),
    "Hz": UnitOfMeasure("HTZ", "hertz"),
    "1/s": UnitOfMeasure("C97", "reciprocal second"),
    "1/min": UnitOfMeasure("C94", "reciprocal minute"),
    "1/h": UnitOfMeasure("H10", "reciprocal hour"),
    "1/m^2": UnitOfMeasure("C93", "reciprocal square metre"),
    "N": UnitOfMeasure("NEW", "newton"),
    "J": UnitOfMeasure("JOU", "joule"),
    "%": UnitOfMeasure("P1", "percent"),
}
"""By how a tag writes them."""


Kind = Literal["bool", "count", "number", "enumeration"]
"""bool: 0 or 1; count: a whole number; enumeration: a whole number that stands for a text."""

Role = Literal["actual", "setpoint", "status", "command", "counter", "alarm", "fault", "run"]
"""actual: measured; setpoint: a number that a controller gives; status: what a device is doing; command: a switch or
push-button that a controller works; counter: how often, or for how long in all; alarm: of the line; fault: injected by
a test; run: about the simulation itself."""

Adds = Literal["", "fed", "removed", "rejected", "state"]
"""What a signal adds to: bottles put onto the line, taken off it, thrown out of it; or whether it is the state of a
machine, each change of which is an event; "": neither."""

SIGNALS: tuple[Role, ...] = ("actual", "status", "counter", "alarm")
"""Roles of what a controller reads."""

COMMANDS: tuple[Role, ...] = ("setpoint", "command")
"""Roles of what it writes."""

MOST_COUNT = 2.0**53
"""The largest count: up to it a float64 has all whole numbers."""

LONGEST = 2.0**31
"""s, of times: the seconds of a message header are 32 bits."""


@dataclass(frozen=True)
class Tag:
    """One value of a line, by name. In docs and tables it stands as it is here: no field may be left empty."""

    name: str
    """Whole: "machines/filler/running"."""
    kind: Kind
    role: Role
    description: str
    """One short sentence."""
    unit: str = "1"
    """One of `UNITS`; "1" where it has no dimension."""
    low: float = 0.0
    """Of a command or fault: the limits of what is accepted; of a signal: the range that a display should span."""
    high: float = 1.0
    initial: float = 0.0
    """At the start, before there are bottles; of a command: what is in force until one is given."""
    nominal: float | None = None
    """What it is designed for, where there is such a value: a machine's rate."""
    texts: Mapping[int, str] = field(default_factory=dict, hash=False)
    """Of an enumeration: what each value stands for."""
    adds_to: Adds = ""
    shows: str = ""
    """Attribute of its device that is its value; "": what the device's `values` gives."""
    device: str = ""
    """Filled in by the line, as `device_class`: the device that it belongs to."""
    device_class: str = ""
    """What kind of a device that is: "photo_eye"."""

    def of(self, attribute: str) -> Tag:
        """The same, of a signal whose value is an attribute of its device."""
        return replace(self, shows=attribute)

    def without_limits(self) -> Tag:
        """Return the tag without limits. Forces may set any value of its kind."""
        return replace(self, low=-math.inf, high=math.inf) if self.kind in ("number", "count") else self

    @property
    def unece(self) -> UnitOfMeasure:
        """Its unit in UNECE Recommendation 20."""
        return UNITS[self.unit]

    @property
    def listed_texts(self) -> str:
        """Its values with what they stand for: "0 stopped, 4 idle"; empty if it is no enumeration."""
        return ", ".join(f"{value} {text}" for value, text in self.texts.items())


def switch(name: str, role: Role, description: str, initial: float = 0.0, adds_to: Adds = "") -> Tag:
    """A tag that is off (0) or on (1)."""
    return Tag(name, "bool", role, description, initial=initial, adds_to=adds_to)


def count(
    name: str, role: Role, description: str, low: float = 0.0, high: float = MOST_COUNT, adds_to: Adds = ""
) -> Tag:
    """A tag that is a whole number, 0 at the start."""
    return Tag(name, "count", role, description, low=low, high=high, adds_to=adds_to)


def number(
    name: str,
    role: Role,
    description: str,
    unit: str,
    low: float,
    high: float,
    initial: float = 0.0,
    nominal: float | None = None,
) -> Tag:
    """A tag that is any number within a range."""
    return Tag(name, "number", role, description, unit, low, high, initial, nominal)


def seconds(name: str, role: Role, description: str) -> Tag:
    """A tag that is a simulated time, or for how long in all, s."""
    return number(name, role, description, "s", 0.0, LONGEST)


def choice(
    name: str, role: Role, description: str, texts: Mapping[int, str], initial: int = 0, adds_to: Adds = ""
) -> Tag:
    """A tag that is one of several states."""
    low, high = min(texts), max(texts)
    return Tag(name, "enumeration", role, description, "1", low, high, float(initial), texts=texts, adds_to=adds_to)
