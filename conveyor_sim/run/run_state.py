# SPDX-License-Identifier: Apache-2.0
"""State of a stepped run, and the log that it writes."""

from enum import IntEnum
from typing import Protocol

from conveyor_sim.line import run_state
from conveyor_sim.line.run_state import RunState
from conveyor_sim.support.printable import SENTENCE, printable


class SimulationState(IntEnum):
    """State of a run; the numbers of simulation_interfaces/msg/SimulationState."""

    STOPPED = 0
    PLAYING = 1
    PAUSED = 2
    QUITTING = 3


def run_state_of(state: SimulationState, failure: str, ended: bool, owner: str) -> RunState:
    """Return the content of topic `run_state`.

    failure: reason why the run can't go on. ended: the scene has ended. owner: owner in lockstep.
    """
    if failure:
        return RunState(run_state.STOPPED, printable(failure, SENTENCE))
    if ended:
        return RunState(run_state.ENDED)
    if owner:
        return RunState(run_state.LOCKSTEP, printable(owner))
    if state is SimulationState.STOPPED:
        return RunState(run_state.STOPPED, "reset and stopped on request")
    return RunState(run_state.RUNNING if state is SimulationState.PLAYING else run_state.PAUSED)


class Log(Protocol):
    """Log of a stepper: a ROS logger or one of `logging`."""

    def info(self, message: str) -> object:
        """Log progress."""

    def warning(self, message: str) -> object:
        """Log a problem that the run survives."""

    def error(self, message: str) -> object:
        """Log the reason why a run stops."""
