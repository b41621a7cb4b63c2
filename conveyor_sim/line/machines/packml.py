# SPDX-License-Identifier: Apache-2.0
"""The PackML state model: 17 states, ten commands, and the transitions.

Numbers are those of StateCurrent and CntrlCmd in PackML (OPC 30050, Beckhoff Tc3_PackML_V3). As in OPC 30050, Hold is
allowed not only in Execute but also on the way to and from it and in Suspended, because a machine can fail there.
"""

from collections.abc import Collection, Mapping
from enum import IntEnum
from typing import Literal


class PackMLState(IntEnum):
    """States of a machine, numbered as in StateCurrent. 0, Undefined, is not included."""

    CLEARING = 1
    STOPPED = 2
    STARTING = 3
    IDLE = 4
    SUSPENDED = 5
    EXECUTE = 6
    STOPPING = 7
    ABORTING = 8
    ABORTED = 9
    HOLDING = 10
    HELD = 11
    UNHOLDING = 12
    SUSPENDING = 13
    UNSUSPENDING = 14
    RESETTING = 15
    COMPLETING = 16
    COMPLETE = 17


class Command(IntEnum):
    """Commands to a machine, numbered as in CntrlCmd. 0 is no command."""

    RESET = 1
    START = 2
    STOP = 3
    HOLD = 4
    UNHOLD = 5
    SUSPEND = 6
    UNSUSPEND = 7
    ABORT = 8
    CLEAR = 9
    COMPLETE = 10


StateNumber = Literal[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17]
"""PackMLState as a plain number, for checkpoints."""

CNTRL_CMD = "/cntrl_cmd"
"""Ending of the names of commands that take PackML commands."""

_S = PackMLState

FROM: Mapping[Command, frozenset[PackMLState]] = {
    Command.RESET: frozenset({_S.STOPPED, _S.COMPLETE}),
    Command.START: frozenset({_S.IDLE}),
    Command.STOP: frozenset(PackMLState) - {_S.CLEARING, _S.STOPPED, _S.STOPPING, _S.ABORTING, _S.ABORTED},
    Command.HOLD: frozenset({_S.EXECUTE, _S.STARTING, _S.SUSPENDED, _S.UNHOLDING, _S.SUSPENDING, _S.UNSUSPENDING}),
    Command.UNHOLD: frozenset({_S.HELD}),
    Command.SUSPEND: frozenset({_S.EXECUTE}),
    Command.UNSUSPEND: frozenset({_S.SUSPENDED}),
    Command.ABORT: frozenset(PackMLState) - {_S.ABORTING, _S.ABORTED},
    Command.CLEAR: frozenset({_S.ABORTED}),
    Command.COMPLETE: frozenset({_S.EXECUTE}),
}
"""States in which a command is allowed."""

TO: Mapping[Command, PackMLState] = {
    Command.RESET: _S.RESETTING,
    Command.START: _S.STARTING,
    Command.STOP: _S.STOPPING,
    Command.HOLD: _S.HOLDING,
    Command.UNHOLD: _S.UNHOLDING,
    Command.SUSPEND: _S.SUSPENDING,
    Command.UNSUSPEND: _S.UNSUSPENDING,
    Command.ABORT: _S.ABORTING,
    Command.CLEAR: _S.CLEARING,
    Command.COMPLETE: _S.COMPLETING,
}
"""Acting state that a command leads to."""

COMPLETES: Mapping[PackMLState, PackMLState] = {
    _S.CLEARING: _S.STOPPED,
    _S.STARTING: _S.EXECUTE,
    _S.STOPPING: _S.STOPPED,
    _S.ABORTING: _S.ABORTED,
    _S.HOLDING: _S.HELD,
    _S.UNHOLDING: _S.EXECUTE,
    _S.SUSPENDING: _S.SUSPENDED,
    _S.UNSUSPENDING: _S.EXECUTE,
    _S.RESETTING: _S.IDLE,
    _S.COMPLETING: _S.COMPLETE,
}
"""Final state of each acting state."""

MODE_STATES = (_S.STOPPED, _S.IDLE, _S.ABORTED, _S.COMPLETE)
"""States in which the control mode of a machine may change: it works on no bottle and does not continue by itself.
PackML leaves this choice to the machine (PML_UnitModeConfig of Beckhoff Tc3_PackML_V3)."""

STATE_TEXTS: Mapping[int, str] = {0: "Undefined", **{state: state.name.capitalize() for state in PackMLState}}
COMMAND_TEXTS: Mapping[int, str] = {0: "none", **{command: command.name.capitalize() for command in Command}}


def objection(command: int, state: int) -> str:
    """Return why a command is not allowed in a state, "" if it is."""
    now, states = PackMLState(state), FROM[Command(command)]
    if now in states:
        return ""
    allowed, refused = ([s for s in PackMLState if (s in states) is taken] for taken in (True, False))
    expected = f"in {_listed(allowed)}" if len(allowed) <= len(refused) else f"outside {_listed(refused)}"
    return f"{COMMAND_TEXTS[command]} given in {STATE_TEXTS[now]}, expected {expected}"


def stops(name: str, value: float) -> bool:
    """Return True if a command is Stop or Abort of a machine. People may send it in every mode."""
    return name.endswith(CNTRL_CMD) and value in (Command.STOP, Command.ABORT)


def mode_objection(state: int) -> str:
    """Return why a control mode can't change in a state, "" if it can."""
    if state in MODE_STATES:
        return ""
    remedy = ": stop it first" if state in FROM[Command.STOP] else ""
    return f"is in {STATE_TEXTS[state]}, expected {_listed(MODE_STATES)} for a change of mode{remedy}"


def _listed(states: Collection[PackMLState]) -> str:
    *most, last = (STATE_TEXTS[state] for state in states)
    return f"{', '.join(most)} or {last}" if most else last


class StateMachine:
    """PackML state of one machine.

    An acting state lasts for its number of ticks; with 0 ticks it ends as soon as it is entered.
    """

    state: StateNumber

    def __init__(
        self, state: PackMLState, ticks: Mapping[PackMLState, int], conditional: Collection[PackMLState] = ()
    ) -> None:
        """Enter the first state.

        ticks: shortest time in acting states, 0 if not listed. conditional: acting states that end only when `advance`
        allows it.
        """
        self._ticks = {acting: ticks.get(acting, 0) for acting in COMPLETES}
        self._conditional = frozenset(conditional)
        self.spent = 0
        """Ticks in the present acting state."""
        self._enter(state)

    def take(self, command: int) -> None:
        """Take a command. Raise ValueError if the state does not allow it."""
        if wrong := objection(command, self.state):
            raise ValueError(wrong)
        self._enter(TO[Command(command)])

    def takes(self, command: int) -> bool:
        """Return True if the state allows a command."""
        return self.state in FROM[Command(command)]

    @property
    def acts(self) -> bool:
        """True in an acting state."""
        return self.state in COMPLETES

    def advance(self, may_complete: bool = True) -> None:
        """Advance by one tick.

        may_complete: True if the condition of a conditional acting state is met.
        """
        after = COMPLETES.get(PackMLState(self.state))
        if after is None:
            return
        self.spent += 1
        if self.spent >= self._ticks[PackMLState(self.state)] and (may_complete or self.state not in self._conditional):
            self._enter(after)

    def _enter(self, state: PackMLState) -> None:
        while state in COMPLETES and not self._ticks[state] and state not in self._conditional:
            state = COMPLETES[state]
        self.state, self.spent = _number(state), 0


def _number(state: PackMLState) -> StateNumber:
    return int(state)  # type: ignore[return-value]
