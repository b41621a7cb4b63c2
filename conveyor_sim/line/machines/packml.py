"""The PackML state model: 17 states, ten commands, and which leads from which to which.

Numbers are those of StateCurrent and CntrlCmd in PackML (OPC 30050, Beckhoff Tc3_PackML_V3). As in OPC 30050, Hold is
taken not in Execute alone but on the way to and from it and while Suspended too: a machine can break down there.
"""

from collections.abc import Collection, Mapping
from enum import IntEnum
from typing import Literal


class State(IntEnum):
    """States of a machine, as StateCurrent has them; 0, Undefined, is none."""

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
    """Commands to a machine, as CntrlCmd has them; 0 is none."""

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
"""A State as a plain number, as checkpoints keep it."""

CNTRL_CMD = "/cntrl_cmd"
"""Ending of the names of commands that take PackML commands."""

FROM: Mapping[Command, frozenset[State]] = {
    Command.RESET: frozenset({State.STOPPED, State.COMPLETE}),
    Command.START: frozenset({State.IDLE}),
    Command.STOP: frozenset(State) - {State.CLEARING, State.STOPPED, State.STOPPING, State.ABORTING, State.ABORTED},
    Command.HOLD: frozenset(
        {State.EXECUTE, State.STARTING, State.SUSPENDED, State.UNHOLDING, State.SUSPENDING, State.UNSUSPENDING}
    ),
    Command.UNHOLD: frozenset({State.HELD}),
    Command.SUSPEND: frozenset({State.EXECUTE}),
    Command.UNSUSPEND: frozenset({State.SUSPENDED}),
    Command.ABORT: frozenset(State) - {State.ABORTING, State.ABORTED},
    Command.CLEAR: frozenset({State.ABORTED}),
    Command.COMPLETE: frozenset({State.EXECUTE}),
}
"""The states in which a command is taken."""

TO: Mapping[Command, State] = {
    Command.RESET: State.RESETTING,
    Command.START: State.STARTING,
    Command.STOP: State.STOPPING,
    Command.HOLD: State.HOLDING,
    Command.UNHOLD: State.UNHOLDING,
    Command.SUSPEND: State.SUSPENDING,
    Command.UNSUSPEND: State.UNSUSPENDING,
    Command.ABORT: State.ABORTING,
    Command.CLEAR: State.CLEARING,
    Command.COMPLETE: State.COMPLETING,
}
"""The acting state that a command leads to."""

COMPLETES: Mapping[State, State] = {
    State.CLEARING: State.STOPPED,
    State.STARTING: State.EXECUTE,
    State.STOPPING: State.STOPPED,
    State.ABORTING: State.ABORTED,
    State.HOLDING: State.HELD,
    State.UNHOLDING: State.EXECUTE,
    State.SUSPENDING: State.SUSPENDED,
    State.UNSUSPENDING: State.EXECUTE,
    State.RESETTING: State.IDLE,
    State.COMPLETING: State.COMPLETE,
}
"""The acting states, each with the state that it leads to once it is complete."""

MODE_STATES = (State.STOPPED, State.IDLE, State.ABORTED, State.COMPLETE)
"""In which a machine's unit mode may change: it works on nothing, and does not go on by itself. PackML leaves it to the
machine which these are (PML_UnitModeConfig of Beckhoff Tc3_PackML_V3).
"""

STATE_TEXTS: Mapping[int, str] = {0: "Undefined", **{state: state.name.capitalize() for state in State}}
COMMAND_TEXTS: Mapping[int, str] = {0: "none", **{command: command.name.capitalize() for command in Command}}


def objection(command: int, state: int) -> str:
    """Why a command is not taken in a state, "" if it is."""
    given, now = Command(command), State(state)
    if now in FROM[given]:
        return ""
    allowed, refused = ([s for s in State if (s in FROM[given]) is taken] for taken in (True, False))
    expected = f"in {_listed(allowed)}" if len(allowed) <= len(refused) else f"outside {_listed(refused)}"
    return f"{COMMAND_TEXTS[given]} given in {STATE_TEXTS[now]}, expected {expected}"


def stops(name: str, value: float) -> bool:
    """Return True if a command is Stop or Abort of a machine. People may send it in every mode."""
    return name.endswith(CNTRL_CMD) and value in (Command.STOP, Command.ABORT)


def mode_objection(state: int) -> str:
    """Why a unit mode can't change in a state, "" if it can."""
    if state in MODE_STATES:
        return ""
    return f"is in {STATE_TEXTS[state]}, expected {_listed(MODE_STATES)} for a change of mode"


def _listed(states: Collection[State]) -> str:
    *most, last = (STATE_TEXTS[state] for state in states)
    return f"{', '.join(most)} or {last}" if most else last


class StateMachine:
    """The state of one machine. An acting state lasts for its ticks; one of none is left as soon as it is entered."""

    state: StateNumber

    def __init__(self, state: State, ticks: Mapping[State, int], conditional: Collection[State] = ()) -> None:
        """ticks: that acting states last at least, 0 for those left out. conditional: acting states that are left only
        when `advance` says that they may be, however long they have lasted.
        """
        self._ticks = {acting: ticks.get(acting, 0) for acting in COMPLETES}
        self._conditional = frozenset(conditional)
        self.spent = 0
        """Ticks in the present state, if it is an acting one."""
        self._enter(state)

    def take(self, command: int) -> None:
        """Take a command. Raises ValueError, in words, where the state does not allow it."""
        if wrong := objection(command, self.state):
            raise ValueError(wrong)
        self._enter(TO[Command(command)])

    def takes(self, command: int) -> bool:
        """Whether the state allows a command."""
        return self.state in FROM[Command(command)]

    @property
    def acts(self) -> bool:
        """Whether it is in an acting state."""
        return self.state in COMPLETES

    def advance(self, may_complete: bool = True) -> None:
        """A tick has passed. may_complete: whether what a conditional state waits for is there."""
        after = COMPLETES.get(State(self.state))
        if after is None:
            return
        self.spent += 1
        if self.spent >= self._ticks[State(self.state)] and (may_complete or self.state not in self._conditional):
            self._enter(after)

    def _enter(self, state: State) -> None:
        while state in COMPLETES and not self._ticks[state] and state not in self._conditional:
            state = COMPLETES[state]
        self.state, self.spent = _number(state), 0


def _number(state: State) -> StateNumber:
    return int(state)  # type: ignore[return-value]
