# SPDX-License-Identifier: Apache-2.0
"""Machines and people: Stop and Abort in every control mode, and states in which the mode may change."""

from pathlib import Path

import pytest
from line.machines.machine_line import line, signals, sink, source

from conveyor_sim.line.commands.inputs import MODE, SET, CommandOutcome, Input
from conveyor_sim.line.machines.packml import MODE_STATES, Command, PackMLState
from conveyor_sim.simulation import Simulation

FILLER = "machines/filler"
COMMAND, RUN = f"{FILLER}/cntrl_cmd", f"{FILLER}/run"
AUTOMATIC, MAINTENANCE, MANUAL = 1.0, 2.0, 3.0


def filling() -> Simulation:
    return line(machines={"filler": source(), "packer": sink()}, duration=100.0)


def act(sim: Simulation, kind: str, operation: str, *given: tuple[str, float]) -> CommandOutcome:
    """Return the result of an input in the next tick."""
    names, values = zip(*given, strict=True)
    sim.take_outcomes()
    sim.give(Input("here", "Jo", kind, operation, names, values))
    sim.advance()
    (outcome,) = sim.take_outcomes()
    return outcome


def command(sim: Simulation, kind: str, *words: Command) -> list[bool]:
    return [act(sim, kind, SET, (COMMAND, float(word))).accepted for word in words]


def mode(sim: Simulation, kind: str, number: float) -> str:
    """Return why a mode is refused, "" if it is not."""
    return act(sim, kind, MODE, (FILLER, number)).reason


def state(sim: Simulation) -> int:
    return int(signals(sim)[f"{FILLER}/state"])


def reason(sim: Simulation) -> str:
    """Return the reason for the present or last stop."""
    says = sim.process_image.signals[sim.process_image.signal_names.index(f"{FILLER}/stop_reason")]
    return says.texts[int(signals(sim)[says.name])]


@pytest.mark.parametrize("kind", ["operator", "engineer"])
@pytest.mark.parametrize(("word", "then"), [(Command.STOP, PackMLState.STOPPED), (Command.ABORT, PackMLState.ABORTED)])
@pytest.mark.parametrize("number", [AUTOMATIC, MAINTENANCE, MANUAL])
def test_a_person_stops_a_machine_in_whatever_mode(kind: str, word: Command, then: PackMLState, number: float) -> None:
    sim = filling()
    if number != AUTOMATIC:
        command(sim, "test", Command.STOP)
        assert mode(sim, "engineer", number) == ""
        assert command(sim, "test", Command.RESET, Command.START) == [True, True]
    assert command(sim, kind, word) == [True]
    assert state(sim) == then
    assert signals(sim)[f"{FILLER}/mode"] == number
    assert reason(sim) == f"command {word.name.capitalize()} by hand"


def test_the_stop_reason_tells_a_person_s_command_from_a_controller_s() -> None:
    """The writer of the input decides, not the control mode. A test counts as a controller."""
    sim = filling()
    for kind, ending in (("controller", ""), ("test", ""), ("operator", " by hand"), ("engineer", " by hand")):
        if kind == "operator":
            command(sim, "test", Command.STOP)
            assert mode(sim, kind, MANUAL) == ""
            command(sim, kind, Command.RESET, Command.START)
        for word, back in (
            (Command.HOLD, [Command.UNHOLD]),
            (Command.SUSPEND, [Command.UNSUSPEND]),
            (Command.STOP, [Command.RESET, Command.START]),
            (Command.ABORT, [Command.CLEAR, Command.RESET, Command.START]),
            (Command.COMPLETE, [Command.RESET, Command.START]),
        ):
            assert command(sim, kind, word) == [True]
            assert reason(sim) == f"command {word.name.capitalize()}{ending}", kind
            assert all(command(sim, kind, *back))
        assert act(sim, kind, SET, (RUN, 0.0)).accepted
        assert (state(sim), reason(sim)) == (PackMLState.STOPPED, f"command run{ending}")
        assert act(sim, kind, SET, (RUN, 1.0)).accepted
        assert (state(sim), reason(sim)) == (PackMLState.EXECUTE, f"command run{ending}")


@pytest.mark.parametrize("word", [word for word in Command if word not in (Command.STOP, Command.ABORT)])
def test_nothing_else_is_taken_of_an_operator_in_automatic(word: Command) -> None:
    sim = filling()
    outcome = act(sim, "operator", SET, (COMMAND, float(word)))
    assert outcome.without_control and "is in Automatic, expected Manual" in outcome.reason
    both = act(sim, "operator", SET, (COMMAND, float(Command.STOP)), (f"{FILLER}/rate", 1.0))
    assert both.without_control and state(sim) == PackMLState.EXECUTE, "a set is taken as a whole or not at all"


@pytest.mark.parametrize("held", [Command.START, Command.RESET, Command.STOP])
def test_a_controller_that_holds_its_last_command_does_not_undo_it(held: Command) -> None:
    """A person's stop stays while the controller repeats its commands in every scan."""
    sim = filling()
    before = [Command.STOP, Command.RESET, Command.START]
    command(sim, "controller", *before[: before.index(held) + 1])
    if held != Command.START:  # it went on by the other switch
        for value in (0.0, 1.0):
            act(sim, "controller", SET, (RUN, value))
    for _ in range(2):
        assert state(sim) == PackMLState.EXECUTE
        assert command(sim, "operator", Command.STOP) == [True]
        for _ in range(3):
            assert act(sim, "controller", SET, (COMMAND, float(held)), (RUN, 1.0)).accepted
            assert state(sim) == PackMLState.STOPPED
        for value in (0.0, 1.0):  # it may start it again: to keep it from that, the machine is taken to Manual
            act(sim, "controller", SET, (RUN, value))


def test_a_machine_changes_hands_only_where_it_works_on_nothing() -> None:
    sim = filling()
    says = f"{FILLER}: is in Execute, expected Stopped, Idle, Aborted or Complete for a change of mode: stop it first"
    assert mode(sim, "operator", MANUAL) == says and mode(sim, "engineer", MAINTENANCE) == says
    assert mode(sim, "operator", AUTOMATIC) == "", "it is in it"
    for words in ([Command.STOP], [Command.RESET], [Command.START, Command.COMPLETE], [Command.ABORT]):
        command(sim, "test", *words)
        assert state(sim) in MODE_STATES
        assert mode(sim, "operator", MANUAL) == mode(sim, "operator", AUTOMATIC) == ""
    command(sim, "test", Command.CLEAR, Command.RESET, Command.START, Command.HOLD)
    assert state(sim) == PackMLState.HELD and "is in Held" in mode(sim, "operator", MANUAL)
    command(sim, "test", Command.UNHOLD, Command.SUSPEND)
    assert state(sim) == PackMLState.SUSPENDED and "is in Suspended" in mode(sim, "operator", MANUAL)


def test_an_operator_takes_a_machine_and_gives_it_back() -> None:
    """It is stopped in Automatic, then operated in Manual.

    With `run` off it returns, and its controller starts it.
    """
    sim = filling()
    assert command(sim, "operator", Command.STOP) == [True]
    assert mode(sim, "operator", MANUAL) == ""
    assert not act(sim, "controller", SET, (RUN, 1.0)).accepted
    assert command(sim, "operator", Command.RESET, Command.START) == [True, True]
    assert state(sim) == PackMLState.EXECUTE
    assert act(sim, "operator", SET, (RUN, 0.0)).accepted
    assert mode(sim, "operator", AUTOMATIC) == ""
    assert state(sim) == PackMLState.STOPPED
    assert act(sim, "controller", SET, (RUN, 1.0)).accepted
    assert state(sim) == PackMLState.EXECUTE


def test_a_stop_by_hand_is_in_a_checkpoint(tmp_path: Path) -> None:
    sim = filling()
    command(sim, "controller", Command.STOP, Command.RESET, Command.START)
    sim.give(Input("here", "Jo", "operator", SET, (COMMAND,), (float(Command.STOP),)))
    sim.save(tmp_path / "kept")
    again = Simulation.load(tmp_path / "kept")
    for one in (sim, again):
        one.advance(3)
        assert state(one) == PackMLState.STOPPED
    assert again.signals().tolist() == sim.signals().tolist()
    assert [outcome.accepted for outcome in again.take_outcomes()] == [True]
