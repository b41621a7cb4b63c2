# SPDX-License-Identifier: Apache-2.0
"""`Tag`: description of one value of a line that is read, written, or injected by a test. `ProcessImage`: all of them.

Units have their codes of UNECE Recommendation 20, by which OPC UA and other systems identify them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple


class UnitOfMeasure(NamedTuple):
    """Unit of measurement."""

    code: str
    """Common code in UNECE Recommendation 20."""
    name: str
    """Name in UNECE Recommendation 20."""


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
    "rad": UnitOfMeasure("C81", "radian"),
    "rad/s": UnitOfMeasure("2A", "radian per second"),
    "N m": UnitOfMeasure("NU", "newton metre"),
    "%": UnitOfMeasure("P1", "percent"),
}
"""Units by their symbols in tags."""


Kind = Literal["bool", "count", "number", "enumeration"]
"""bool: 0 or 1; count: whole number; enumeration: whole number that stands for a text."""

Role = Literal["actual", "setpoint", "status", "command", "counter", "alarm", "fault", "run", "panel"]
"""actual: measured; setpoint: number from a controller; status: state of a device; command: switch or push-button
that a controller writes; counter: number of occurrences or total time; alarm: of the line; fault: injected by a test;
run: about the simulation; panel: input that an operator uses at the panel, whatever the control mode."""

Adds = Literal["", "fed", "removed", "rejected", "state"]
"""Sum that a signal adds to: bottles put onto the line, taken off it, or rejected. "state": each change of the
signal is an event. "": neither."""

SIGNALS: tuple[Role, ...] = ("actual", "status", "counter", "alarm")
"""Roles of tags that a controller reads."""

PANEL: Role = "panel"
"""Role of tags that people and tests write, and controllers do not."""

CONTROLLED: tuple[Role, ...] = ("setpoint", "command")
"""Roles of tags that a controller writes."""

COMMANDS: tuple[Role, ...] = (*CONTROLLED, PANEL)
"""Roles of tags that clients write."""

MOST_COUNT = 2.0**53
"""Largest count. A float64 represents all whole numbers up to it."""

LONGEST = 2.0**31
"""Largest time, s. The seconds of a message header have 32 bits."""


@dataclass(frozen=True)
class Tag:
    """One value of a line, by name. Docs and tables display the fields unchanged, so a description is required."""

    name: str
    """Full name: "machines/filler/running"."""
    kind: Kind
    role: Role
    description: str
    """One short sentence."""
    unit: str = "1"
    """Symbol in `UNITS`; "1" without a dimension."""
    low: float = 0.0
    """Lower limit of accepted commands and faults, or of the range that a display should span."""
    high: float = 1.0
    initial: float = 0.0
    """Value at the start, before there are bottles; for a command, the value in force until the first command."""
    nominal: float | None = None
    """Design value, if there is one: the rate of a machine."""
    texts: Mapping[int, str] = field(default_factory=dict, hash=False)
    """Text of each value of an enumeration."""
    adds_to: Adds = ""
    shows: str = ""
    """Attribute of its device that holds the value; "": `values` of the device returns it."""
    device: str = ""
    """Name of its device; set by the line, as is `device_class`."""
    device_class: str = ""
    """Kind of its device: "photo_eye"."""

    def of(self, attribute: str) -> Tag:
        """Return the tag for a signal whose value is an attribute of its device."""
        return replace(self, shows=attribute)

    def without_limits(self) -> Tag:
        """Return the tag without limits. Forces may set any value of its kind."""
        return replace(self, low=-math.inf, high=math.inf) if self.kind in ("number", "count") else self

    @property
    def unece(self) -> UnitOfMeasure:
        """Unit in UNECE Recommendation 20."""
        return UNITS[self.unit]

    @property
    def listed_texts(self) -> str:
        """Values with their texts: "0 stopped, 4 idle"; "" if the tag is no enumeration."""
        return ", ".join(f"{value} {text}" for value, text in self.texts.items())


def switch(name: str, role: Role, description: str, initial: float = 0.0, adds_to: Adds = "") -> Tag:
    """Return a tag that is off (0) or on (1)."""
    return Tag(name, "bool", role, description, initial=initial, adds_to=adds_to)


def count(
    name: str, role: Role, description: str, low: float = 0.0, high: float = MOST_COUNT, adds_to: Adds = ""
) -> Tag:
    """Return a tag with a whole number, 0 at the start."""
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
    """Return a tag with a number within a range."""
    return Tag(name, "number", role, description, unit, low, high, initial, nominal)


def seconds(name: str, role: Role, description: str) -> Tag:
    """Return a tag with a simulated time or a duration, s."""
    return number(name, role, description, "s", 0.0, LONGEST)


def choice(
    name: str, role: Role, description: str, texts: Mapping[int, str], initial: int = 0, adds_to: Adds = ""
) -> Tag:
    """Return a tag with one of several states."""
    low, high = min(texts), max(texts)
    return Tag(name, "enumeration", role, description, "1", low, high, float(initial), texts=texts, adds_to=adds_to)


@dataclass(frozen=True)
class ProcessImage:
    """Tags of a line, and tables of them by role. Values are sent in the order of these tables."""

    tags: tuple[Tag, ...]
    signals: tuple[Tag, ...] = field(init=False)
    commands: tuple[Tag, ...] = field(init=False)
    faults: tuple[Tag, ...] = field(init=False)
    """Faults. Tests inject them, controllers don't see them."""
    signal_names: tuple[str, ...] = field(init=False)
    command_names: tuple[str, ...] = field(init=False)
    fault_names: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        for table, roles in (("signal", SIGNALS), ("command", COMMANDS), ("fault", ("fault",))):
            chosen = of_roles(self.tags, roles)
            object.__setattr__(self, f"{table}s", chosen)
            object.__setattr__(self, f"{table}_names", tuple(tag.name for tag in chosen))

    @property
    def command_limits(self) -> dict[str, tuple[float, float]]:
        """Minimum and maximum of each command, by name."""
        return {tag.name: (tag.low, tag.high) for tag in self.commands}


def of_roles(tags: Sequence[Tag], roles: Sequence[Role]) -> tuple[Tag, ...]:
    """Return the tags that have one of some roles, in their order."""
    return tuple(tag for tag in tags if tag.role in roles)


def speed_command(belt: str) -> str:
    """Return the name of a belt's speed setpoint, which is also its topic."""
    return f"belts/{belt}/cmd_speed"


def speed_topics(belts: Sequence[str], commands: Sequence[str]) -> list[str]:
    """Return the topics of speed setpoints, of all belts and of named drives, from names of belts and commands.

    Belts that a named drive moves have a topic, too, because a refusal with a reason is better than no answer.
    """
    drives = [name for name in commands if name.startswith("drives/") and name.endswith("/cmd_speed")]
    return [*map(speed_command, belts), *drives]
