# SPDX-License-Identifier: Apache-2.0
"""One alarm: its states by ISA-18.2, and what leads from one to another."""

import math
from enum import IntEnum
from typing import Literal

from conveyor_sim.columns.events import Kind
from conveyor_sim.scene.parts.alarm import AlarmFields


class AlarmState(IntEnum):
    """States of ISA-18.2, in its order (A to I there)."""

    NORMAL = 0
    UNACKNOWLEDGED = 1
    ACKNOWLEDGED = 2
    RETURNED = 3
    """Returned to normal, not acknowledged."""
    LATCHED_UNACKNOWLEDGED = 4
    """The condition has ended; the alarm waits to be acknowledged, then reset."""
    LATCHED_ACKNOWLEDGED = 5
    SHELVED = 6
    SUPPRESSED = 7
    """Suppressed by design: an alarm that causes this one is standing."""
    OUT_OF_SERVICE = 8
    UNCONFIRMED = 9
    """Acknowledged, waits to be confirmed; this and the next two are states of OPC UA (OPC 10000-9, 4.3)."""
    RETURNED_UNCONFIRMED = 10
    """Returned to normal and acknowledged, waits to be confirmed."""
    LATCHED_UNCONFIRMED = 11
    """Latched and acknowledged, waits to be confirmed, then reset."""


Shelving = Literal["", "timed", "one_shot"]
"""Kind of shelving. one_shot: until the condition ends."""

_S = AlarmState

RAISED = {
    _S.NORMAL: _S.UNACKNOWLEDGED,
    _S.RETURNED: _S.UNACKNOWLEDGED,
    _S.LATCHED_UNACKNOWLEDGED: _S.UNACKNOWLEDGED,
    _S.LATCHED_ACKNOWLEDGED: _S.UNACKNOWLEDGED,
    _S.RETURNED_UNCONFIRMED: _S.UNACKNOWLEDGED,
    _S.LATCHED_UNCONFIRMED: _S.UNACKNOWLEDGED,
}
"""Next state when the condition begins."""

CLEARED = {
    _S.UNACKNOWLEDGED: _S.RETURNED,
    _S.ACKNOWLEDGED: _S.NORMAL,
    _S.UNCONFIRMED: _S.RETURNED_UNCONFIRMED,
}
"""Next state when the condition ends, without latching."""

LATCHED = {
    _S.UNACKNOWLEDGED: _S.LATCHED_UNACKNOWLEDGED,
    _S.ACKNOWLEDGED: _S.LATCHED_ACKNOWLEDGED,
    _S.UNCONFIRMED: _S.LATCHED_UNCONFIRMED,
}
"""Next state when the condition ends, with latching."""

ACKNOWLEDGED = {
    _S.UNACKNOWLEDGED: _S.ACKNOWLEDGED,
    _S.RETURNED: _S.NORMAL,
    _S.LATCHED_UNACKNOWLEDGED: _S.LATCHED_ACKNOWLEDGED,
}
"""Next state on acknowledgement. Alarms in other states can't be acknowledged."""

ACKNOWLEDGED_UNCONFIRMED = {
    _S.UNACKNOWLEDGED: _S.UNCONFIRMED,
    _S.RETURNED: _S.RETURNED_UNCONFIRMED,
    _S.LATCHED_UNACKNOWLEDGED: _S.LATCHED_UNCONFIRMED,
}
"""Next state on acknowledgement of an alarm that must be confirmed."""

CONFIRMED = {
    _S.UNCONFIRMED: _S.ACKNOWLEDGED,
    _S.RETURNED_UNCONFIRMED: _S.NORMAL,
    _S.LATCHED_UNCONFIRMED: _S.LATCHED_ACKNOWLEDGED,
}
"""Next state on confirmation. Alarms in other states can't be confirmed."""

RESET = {_S.LATCHED_ACKNOWLEDGED: _S.NORMAL}
"""Next state on reset. Alarms in other states can't be reset."""

ACTIVE = frozenset({_S.UNACKNOWLEDGED, _S.ACKNOWLEDGED, _S.UNCONFIRMED})
"""States while the condition holds."""
STANDING = ACTIVE | {_S.LATCHED_UNACKNOWLEDGED, _S.LATCHED_ACKNOWLEDGED, _S.LATCHED_UNCONFIRMED}
WAITING = frozenset(ACKNOWLEDGED)
"""States that wait for an acknowledgement."""
HIDDEN = frozenset({_S.SHELVED, _S.SUPPRESSED, _S.OUT_OF_SERVICE})
"""States of alarms that are not displayed."""

NEVER = -1
"""Tick of an event that is not scheduled."""


class LineAlarm:
    """One alarm. Call `settle` after each change of `active`, `suppressed`, `shelved` or `out_of_service`."""

    def __init__(self, id: str, number: int, fields: AlarmFields, declared_by: str, own: bool, tick: float) -> None:
        """Start as a normal alarm.

        number: from 1, in the order of declaration. declared_by: "" if not declared. own: True for alarms of the line
        or the scene. tick: its length, s.
        """
        self.id, self.number, self.own = id, number, own
        self.condition = False
        """Condition as last reported."""
        self.active = False
        """Condition after the delays."""
        self.due = NEVER
        """Tick at which `active` follows `condition`."""
        self.main = AlarmState.NORMAL
        """State without shelving, suppression and removal from service."""
        self.shelved: Shelving = ""
        self.shelved_until = NEVER
        self.suppressed = False
        self.out_of_service = False
        self.shown = AlarmState.NORMAL
        """State after the last call of `settle`."""
        self.since = 0
        """Tick of the last change of state."""
        self.changed_by = ""
        """Writer of the last acknowledgement, shelving, reset, ..."""
        self.rank = 0
        """Length of the longest chain of suppressing alarms that leads to this one."""
        self.suppressing = False
        """True if the alarm suppressed others after the last call of `settle`."""
        self._heard = self._was_hidden = False
        self.declare(fields, declared_by, tick)

    def declare(self, fields: AlarmFields, declared_by: str, tick: float) -> None:
        """Take over a declaration. The state stays."""
        self.fields, self.declared_by = fields, declared_by
        self.text = fields.text or self.id
        self.delays = (ticks(fields.off_delay, tick), ticks(fields.on_delay, tick))
        """Off-delay and on-delay in ticks."""

    @property
    def state(self) -> AlarmState:
        """State as displayed."""
        if self.out_of_service:
            return AlarmState.OUT_OF_SERVICE
        if self.shelved:
            return AlarmState.SHELVED
        return AlarmState.SUPPRESSED if self.suppressed else self.main

    @property
    def hidden(self) -> bool:
        """Return True if the alarm is shelved, suppressed or out of service."""
        return bool(self.shelved) or self.suppressed or self.out_of_service

    @property
    def is_reported(self) -> bool:
        """Return True if a controller last reported that the condition holds."""
        return self.condition and not self.own and not self.fields.measured

    @property
    def stands(self) -> bool:
        """Return True if the alarm is displayed, and active or latched."""
        return self.main in STANDING

    @property
    def suppresses(self) -> bool:
        """Return True if alarms caused by this one are suppressed. An active alarm suppresses even while shelved."""
        return (self.active or self.stands) and not self.out_of_service

    def settle(self) -> list[Kind]:
        """Enter the next state, and return the kinds of the resulting events."""
        rose, fell = self.active and not self._heard, self._heard and not self.active
        self._heard = self.active
        happened: list[Kind] = []
        if fell and self.shelved == "one_shot":
            self.shelved, happened = "", ["alarm_unshelved"]
        was_hidden, self._was_hidden = self._was_hidden, self.hidden
        if self.hidden:
            # An alarm that is normal and stays normal causes no event.
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
        """Treat the condition as inactive until a tick, although it has not ended."""
        self.active = self._heard = False
        self.due = due

    def recall(self) -> None:
        """Derive the remaining attributes after a restore."""
        self._heard, self._was_hidden = self.active, self.hidden
        self.suppressing, self.shown = self.suppresses, self.state

    @property
    def _to_be_seen(self) -> bool:
        return self.active or self.main is not AlarmState.NORMAL


def ticks(seconds: float, tick: float) -> int:
    """Return the fewest ticks that last at least `seconds`."""
    return math.ceil(seconds / tick - 1e-9)
