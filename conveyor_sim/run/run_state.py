"""What a run may be doing, and where it reports it."""

from enum import IntEnum
from typing import Protocol

from conveyor_sim.line import run_state
from conveyor_sim.line.run_state import RunState
from conveyor_sim.support.printable import SENTENCE, printable


class State(IntEnum):
    """As simulation_interfaces/msg/SimulationState."""

    STOPPED = 0
    PLAYING = 1
    PAUSED = 2
    QUITTING = 3


def run_state_of(state: State, failure: str, ended: bool, owner: str) -> RunState:
    """What topic `run_state` shows. failure: why it can't go on; ended: at the end of the scene; owner: of lockstep."""
    if failure:
        return RunState(run_state.STOPPED, printable(failure, SENTENCE))
    if ended:
        return RunState(run_state.ENDED)
    if owner:
        return RunState(run_state.LOCKSTEP, printable(owner))
    if state is State.STOPPED:
        return RunState(run_state.STOPPED, "reset and stopped on request")
    return RunState(run_state.RUNNING if state is State.PLAYING else run_state.PAUSED)


class Log(Protocol):
    """Where the stepper writes what happened; a ROS logger or one of `logging`."""

    def info(self, message: str) -> object: ...
    def warning(self, message: str) -> object: ...
    def error(self, message: str) -> object: ...
