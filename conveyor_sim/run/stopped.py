"""Saves the state in which the guard stopped a run, beside its recording."""

from pathlib import Path

from conveyor_sim.errors import CheckpointError, SimulationError
from conveyor_sim.simulation import Simulation

FILE_NAME = "stopped.npz"
"""A checkpoint (`Simulation.load`), in the folder of the recording."""


def keep_stopped(simulation: Simulation, folder: Path | None, error: SimulationError) -> SimulationError:
    """Write the state before the failed tick into a folder, if one is passed. Return the error with the path."""
    if folder is None:
        return error
    path = folder / FILE_NAME
    try:
        simulation.save(path)
    except CheckpointError as failed:
        return SimulationError(f"{error}; the state before that tick was not saved: {failed}", error.kind)
    return SimulationError(f"{error}; the state before that tick is in {path}", error.kind)
