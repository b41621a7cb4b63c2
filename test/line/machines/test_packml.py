# SPDX-License-Identifier: Apache-2.0
"""The PackML state model: every command in every state, every acting state, and their durations."""

import pytest
from facts import missing

from conveyor_sim.line.machines.packml import (
    COMMAND_TEXTS,
    COMPLETES,
    STATE_TEXTS,
    TO,
    Command,
    PackMLState,
    StateMachine,
    objection,
)

NUMBERS = """
0 Undefined, 1 Clearing, 2 Stopped, 3 Starting, 4 Idle, 5 Suspended, 6 Execute, 7 Stopping, 8 Aborting, 9 Aborted,
10 Holding, 11 Held, 12 Unholding, 13 Suspending, 14 Unsuspending, 15 Resetting, 16 Completing, 17 Complete
"""

COMMANDS = "0 none, 1 Reset, 2 Start, 3 Stop, 4 Hold, 5 Unhold, 6 Suspend, 7 Unsuspend, 8 Abort, 9 Clear, 10 Complete"

TAKEN = {
    "Reset": "2 17",
    "Start": "4",
    "Stop": "3 4 5 6 10 11 12 13 14 15 16 17",
    "Hold": "3 5 6 12 13 14",
    "Unhold": "11",
    "Suspend": "6",
    "Unsuspend": "5",
    "Abort": "1 2 3 4 5 6 7 10 11 12 13 14 15 16 17",
    "Clear": "9",
    "Complete": "6",
}
"""By command, the numbers of the states that take it."""

LEADS_TO = {
    "Reset": 15, "Start": 3, "Stop": 7, "Hold": 10, "Unhold": 12, "Suspend": 13, "Unsuspend": 14, "Abort": 8,
    "Clear": 1, "Complete": 16,
}  # fmt: skip

WHEN_COMPLETE = {15: 4, 3: 6, 12: 6, 14: 6, 10: 11, 13: 5, 16: 17, 1: 2, 7: 2, 8: 9}


def numbered(text: str) -> dict[int, str]:
    return {int(number): name for number, name in (entry.split() for entry in text.replace("\n", " ").split(","))}


def test_the_numbers_are_those_of_packml() -> None:
    assert dict(STATE_TEXTS) == numbered(NUMBERS)
    assert dict(COMMAND_TEXTS) == numbered(COMMANDS)


@pytest.mark.parametrize("state", PackMLState, ids=lambda state: STATE_TEXTS[state])
@pytest.mark.parametrize("command", Command, ids=lambda command: COMMAND_TEXTS[command])
def test_every_command_in_every_state(command: Command, state: PackMLState) -> None:
    """Each acting state lasts three ticks here, so that it can be seen."""
    machine = StateMachine(state, dict.fromkeys(COMPLETES, 3))
    if str(int(state)) in TAKEN[COMMAND_TEXTS[command]].split():
        assert objection(command, state) == ""
        assert machine.takes(command)
        machine.take(command)
        assert machine.state == LEADS_TO[COMMAND_TEXTS[command]]
    else:
        says = f"{COMMAND_TEXTS[command]} given in {STATE_TEXTS[state]}, expected "
        assert objection(command, state).startswith(says)
        assert not machine.takes(command)
        with pytest.raises(ValueError, match=says):
            machine.take(command)
        assert machine.state == state


@pytest.mark.parametrize(("acting", "after"), WHEN_COMPLETE.items(), ids=lambda state: STATE_TEXTS[state])
def test_an_acting_state_lasts_and_is_complete(acting: int, after: int) -> None:
    machine = StateMachine(PackMLState(acting), {PackMLState(acting): 3})
    assert machine.acts
    for _ in range(2):
        machine.advance()
        assert machine.state == acting
    machine.advance()
    assert (machine.state, machine.acts, machine.spent) == (after, False, 0)
    machine.advance()
    assert machine.state == after, "it waits there for a command"


@pytest.mark.parametrize(("acting", "after"), WHEN_COMPLETE.items(), ids=lambda state: STATE_TEXTS[state])
def test_one_that_takes_no_time_is_passed_at_once(acting: int, after: int) -> None:
    assert StateMachine(PackMLState(acting), {}).state == after


@pytest.mark.parametrize("ticks", [0, 2])
def test_a_conditional_state_waits_for_its_condition_and_its_time(ticks: int) -> None:
    machine = StateMachine(PackMLState.IDLE, {PackMLState.STARTING: ticks}, [PackMLState.STARTING])
    machine.take(Command.START)
    assert machine.state == PackMLState.STARTING
    machine.advance(True)
    assert machine.state == (PackMLState.EXECUTE if ticks <= 1 else PackMLState.STARTING)
    machine = StateMachine(PackMLState.STARTING, {PackMLState.STARTING: ticks}, [PackMLState.STARTING])
    for _ in range(5):
        machine.advance(False)
        assert machine.state == PackMLState.STARTING
    machine.advance(True)
    assert machine.state == PackMLState.EXECUTE


def test_what_is_refused_says_where_it_is_taken() -> None:
    assert missing(objection(Command.START, PackMLState.STOPPED), "Start", "Stopped", "Idle") == []
    assert missing(objection(Command.RESET, PackMLState.EXECUTE), "Reset", "Execute", "Stopped or Complete") == []
    assert missing(objection(Command.ABORT, PackMLState.ABORTED), "Abort ", "Aborted", "Aborting or Aborted") == []


def test_every_command_leads_to_an_acting_state() -> None:
    assert set(TO.values()) == set(COMPLETES)
    assert len(PackMLState) == 17
