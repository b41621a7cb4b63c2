# SPDX-License-Identifier: Apache-2.0
"""Alarms (ISA-18.2): declarations in a scene file, by a controller or by the line."""

from collections.abc import Iterator
from typing import Annotated, Literal, get_args

from annotated_types import Ge, Le, Len
from pydantic import AfterValidator, Strict, StringConstraints

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.types import Flag, Holds, NotNegative, Number, Says, Text, quantity
from conveyor_sim.scene.words import shown
from conveyor_sim.support.printable import printable

AlarmClass = Literal["error", "warning", "message"]
CLASSES: tuple[AlarmClass, ...] = get_args(AlarmClass)

PRIORITIES = {"error": 800, "warning": 500, "message": 200}
"""Default priorities by class, in the ranges of severity of OPC 40083."""

LONGEST_DELAY = 86_400
"""Longest delay and shelving time, s: a day."""

MOST_CAUSES = 100
"""Largest number of alarms that suppress another."""

LONGEST_ID = 100

PREFIX = "alarms/"
"""Prefix of the names of alarms in the process image and in events; ids are without it."""


def id_problem(id: str) -> str:
    """Return why a text can't be the id of an alarm, "" if it can."""
    good = id.isprintable() and id == id.strip() and 0 < len(id) <= LONGEST_ID and not id.startswith(PREFIX)
    return "" if good else f"{shown(id)} given, expected {_ID_WORDS}"


def _id(text: str) -> str:
    if id_problem(text):
        raise ValueError(_ID_WORDS)
    return text


_ID_WORDS = f"an id of 1 to {LONGEST_ID} printable characters, without `{PREFIX}` before it"
AlarmId = Annotated[str, AfterValidator(_id), Says(_ID_WORDS)]
_Priority = Annotated[int, Strict(), Ge(1), Le(1000), Says("a whole number from 1 to 1000")]
_Delay = Annotated[float, Strict(), Ge(0), Le(LONGEST_DELAY), Says(f"a number from 0 to {LONGEST_DELAY}")]
_Short = Annotated[Text, AfterValidator(printable)]
_Group = Annotated[
    str,
    StringConstraints(max_length=100),
    AfterValidator(printable),
    Says("a name of at most 100 characters"),
]


class AlarmFields(Part):
    """Fields of all declarations of an alarm."""

    text: _Short = quantity("Text of the alarm, cut after 200 characters. Left out: its ID.", default="")
    alarm_class: AlarmClass = quantity("Class: error, warning or message.", default="warning")
    priority: _Priority | None = quantity(
        "From 1, lowest, to 1000: OPC UA's severity. Left out: 800 of an error, 500 of a warning, 200 of a message.",
        "1",
        default=None,
    )
    tag: Text | None = quantity("Signal that it is about.", default=None)
    high: Number | None = quantity(
        "The alarm comes when the signal exceeds this value.", "that of the signal", default=None
    )
    low: Number | None = quantity(
        "The alarm comes when the signal falls below this value.", "that of the signal", default=None
    )
    deadband: NotNegative = quantity(
        "Hysteresis: the alarm goes when the signal is at most `high` minus this value, and at least `low` plus "
        "this value.",
        "that of the signal",
        default=0.0,
    )
    on_delay: _Delay = quantity("The alarm comes when its condition has held for this time.", "s", default=0.0)
    off_delay: _Delay = quantity("The alarm goes when its condition has been gone for this time.", "s", default=0.0)
    latching: Flag = quantity("True: the alarm stands until it is acknowledged and reset.", default=False)
    confirm: Flag = quantity(
        "True: once acknowledged, the alarm waits until an operator confirms that its cause has been dealt with.",
        default=False,
    )
    suppressed_by: Annotated[
        tuple[AlarmId, ...], Len(0, MOST_CAUSES), Holds(f"a list of at most {MOST_CAUSES} ids of alarms")
    ] = quantity("IDs of alarms that cause this one. While one of them stands, this alarm is suppressed.", default=())
    group: _Group = quantity(
        "Group in which the first alarm to come is marked (first-out). Left out: none.", default=""
    )

    @property
    def measured(self) -> bool:
        """True if the line evaluates the condition."""
        return self.high is not None or self.low is not None

    @property
    def severity(self) -> int:
        """Priority, given or by class."""
        return PRIORITIES[self.alarm_class] if self.priority is None else self.priority

    def wrong(self) -> Iterator[tuple[str, str]]:
        """Yield fields that do not fit together, each with the rest of the sentence."""
        if not self.measured:
            if self.deadband:
                yield "deadband", f"{shown(self.deadband)} given, expected `high` or `low` beside it"
            return
        if self.tag is None:
            yield "tag", "missing, expected the name of a signal, as `high` or `low` is given"
        if self.high is not None and self.low is not None and self.low + self.deadband > self.high - self.deadband:
            text = "less than `high`, by twice the deadband at least"
            yield "low", f"{shown(self.low)} given, expected {text}: {shown(self.high - 2.0 * self.deadband)} at most"


class MeasuredAlarm(AlarmFields):
    """An alarm of the scene on a measured value."""

    tag: Text = quantity("Monitored signal.")

    def wrong(self) -> Iterator[tuple[str, str]]:
        """Yield fields that do not fit together, and a problem for an alarm without limits."""
        if not self.measured:
            yield "high", "missing, expected a limit, `high` or `low`"
        yield from super().wrong()
