"""One alarm: its states by ISA-18.2, and what leads from one to another."""

import math
from enum import IntEnum
from typing import Literal

from conveyor_sim.columns.events import Kind
from conveyor_sim.scene.parts.alarm import AlarmFields


class AlarmState(IntEnum):
    """The states of ISA-18.2, in its order (A to I there)."""

    NORMAL = 0
    UNACKNOWLEDGED = 1
    ACKNOWLEDGED = 2
    RETURNED = 3
    """To normal, not acknowledged."""
    LATCHED_UNACKNOWLEDGED = 4
    """Its condition is gone; it waits to be acknowledged, then reset."""
    LATCHED_ACKNOWLEDGED = 5
    SHELVED = 6
    SUPPRESSED = 7
    """By design: an alarm that it follows from stands."""
    OUT_OF_SERVICE = 8


Shelving = Literal["", "timed", "one_shot"]
"""one_shot: until its condition ends."""

_S = AlarmState

RAISED = {
    _S.NORMAL: _S.UNACKNOWLEDGED,
    _S.RETURNED: _S.UNACKNOWLEDGED,
    _S.LATCHED_UNACKNOWLEDGED: _S.UNACKNOWLEDGED,
    _S.LATCHED_ACKNOWLEDGED: _S.UNACKNOWLEDGED,
}
"""Where it goes as its condition comes."""

CLEARED = {_S.UNACKNOWLEDGED: _S.RETURNED, _S.ACKNOWLEDGED: _S.NORMAL}
"""Where one that does not latch goes as its condition ends."""

LATCHED = {_S.UNACKNOWLEDGED: _S.LATCHED_UNACKNOWLEDGED, _S.ACKNOWLEDGED: _S.LATCHED_ACKNOWLEDGED}
"""Where one that latches goes then."""

ACKNOWLEDGED = {
    _S.UNACKNOWLEDGED: _S.ACKNOWLEDGED,
    _S.RETURNED: _S.NORMAL,
    _S.LATCHED_UNACKNOWLEDGED: _S.LATCHED_ACKNOWLEDGED,
}
"""Where it goes as somebody acknowledges it; others can't be acknowledged."""

RESET = {_S.LATCHED_ACKNOWLEDGED: _S.NORMAL}
"""Where it goes as somebody resets it; others can't be reset."""

STANDING = frozenset({_S.UNACKNOWLEDGED, _S.ACKNOWLEDGED, _S.LATCHED_UNACKNOWLEDGED, _S.LATCHED_ACKNOWLEDGED})
WAITING = frozenset(ACKNOWLEDGED)

NEVER = -1
"""A tick that does not come."""


class LineAlarm:
    """One alarm. `settle` after any change of `active`, `suppressed`, `shelved` and `out_of_service`."""

    def __init__(self, id: str, number: int, fields: AlarmFields, declared_by: str, own: bool, tick: float) -> None:
        """number: from 1, in the order in which alarms became known. declared_by: "" if nobody did. own: whether that
        is the line or the scene. tick: its length, s.
        """
        self.id, self.number, self.own = id, number, own
        self.condition = False
        """What was said last."""
        self.active = False
        """The same after its delays."""
        self.due = NEVER
        """Tick at which `active` follows `condition`."""
        self.main = AlarmState.NORMAL
        """Its state but for what hides it."""
        self.shelved: Shelving = ""
        self.shelved_until = NEVER
        self.suppressed = False
        self.out_of_service = False
        self.shown = AlarmState.NORMAL
        """Its state when it settled last."""
        self.since = 0
        """Tick of the last change of its state."""
        self.changed_by = ""
        """Who acknowledged, shelved, reset it, ... last."""
        self.rank = 0
        """How many follow one from another up to it, where some are suppressed by others."""
        self.suppressing = False
        """Whether it suppressed others when it settled last."""
        self._heard = self._was_hidden = False
        self.declare(fields, declared_by, tick)

    def declare(self, fields: AlarmFields, declared_by: str, tick: float) -> None:
        """Be as declared from now on; its state stays."""
        self.fields, self.declared_by = fields, declared_by
        self.text = fields.text or self.id
        self.delays = (ticks(fields.off_delay, tick), ticks(fields.on_delay, tick))
        """Ticks, until the end and until the beginning of its condition count."""

    @property
    def state(self) -> AlarmState:
        """As others see it."""
        if self.out_of_service:
            return AlarmState.OUT_OF_SERVICE
        if self.shelved:
            return AlarmState.SHELVED
        return AlarmState.SUPPRESSED if self.suppressed else self.main

    @property
    def hidden(self) -> bool:
        """Whether it is not shown."""
        return bool(self.shelved) or self.suppressed or self.out_of_service

    @property
    def is_said(self) -> bool:
        """Whether a controller has said, last, that its condition holds."""
        return self.condition and not self.own and not self.fields.measured

    @property
    def stands(self) -> bool:
        """Whether it is shown, and active or latched."""
        return self.main in STANDING

    @property
    def suppresses(self) -> bool:
        """Whether what follows from it is suppressed: whatever is shown of it, unless it is out of service."""
        return (self.active or self.stands) and not self.out_of_service

    def settle(self) -> list[Kind]:
        """Go to the state that follows; what happened to it, as kinds of events."""
        rose, fell = self.active and not self._heard, self._heard and not self.active
        self._heard = self.active
        happened: list[Kind] = []
        if fell and self.shelved == "one_shot":
            self.shelved, happened = "", ["alarm_unshelved"]
        was_hidden, self._was_hidden = self._was_hidden, self.hidden
        if self.hidden:
            # Nothing is said of an alarm that is normal and stays so.
            if self.state is AlarmState.SUPPRESSED and (rose or (not was_hidden and self._to_be_seen)):
                happened.append("alarm_suppressed")
            self.main = AlarmState.NORMAL
        elif rose or (was_hidden and self.active):
            self.main = RAISED[self.main]
            happened.append("alarm_raised")
        elif fell and not was_hidden:
            self.main = (LATCHED if self.fields.latching else CLEARED)[self.main]
            happened.append("alarm_latched" if self.fields.latching else "alarm_cleared")
        return happened

    def delay(self, due: int) -> None:
        """Count as not active until a tick, without having ended."""
        self.active = self._heard = False
        self.due = due

    def recall(self) -> None:
        """Its attributes were restored: it has settled."""
        self._heard, self._was_hidden = self.active, self.hidden
        self.suppressing, self.shown = self.suppresses, self.state

    @property
    def _to_be_seen(self) -> bool:
        return self.active or self.main is not AlarmState.NORMAL


def ticks(seconds: float, tick: float) -> int:
    """The fewest ticks in which so much time passes."""
    return math.ceil(seconds / tick - 1e-9)
