"""Errors of runs against reference runs, pooled over starts."""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from conveyor_sim.accuracy.energy import BOTTLE_BOTTLE
from conveyor_sim.accuracy.results import Errors
from conveyor_sim.accuracy.trajectory import Trajectory
from conveyor_sim.engine.arrays import F8


def errors_of(runs: Sequence[tuple[Trajectory, Trajectory]]) -> Errors:
    """Errors of pairs (run, reference run), each from one start over the same ticks.

    Bottles that only one run of a pair has, for it was fed or removed a tick earlier there, are left out.
    """
    distances, forces, impulses, energies = _Pool(), _Pool(), _Pool(), _Pool()
    for run, reference in runs:
        # The start itself is common to both.
        for mine, true in zip(run.frames[1:], reference.frames[1:], strict=True):
            a, b = mine.bottles, true.bottles
            _, here, there = np.intersect1d(a.id, b.id, assume_unique=True, return_indices=True)
            distances.add(np.hypot(a.x[here] - b.x[there], a.y[here] - b.y[there]), np.zeros(here.size))
            energies.add(mine.energies[here].sum(keepdims=True), true.energies[there].sum(keepdims=True))
        a, b = run.frames[-1].bottles, reference.frames[-1].bottles
        _, here, there = np.intersect1d(a.id, b.id, assume_unique=True, return_indices=True)
        forces.add(_largest_forces(run)[here], _largest_forces(reference)[there])
        impulses.add(a.impulse[here], b.impulse[there])
    return Errors(
        position_rms=distances.error,
        position_max=distances.largest,
        peak_force=forces.relative,
        impulse=impulses.relative,
        energy=energies.relative,
    )


def _largest_forces(run: Trajectory) -> F8:
    """Largest normal force of any one contact of each bottle that is there in the end, N, (bottles,).

    With those at ticks: a step has two ends, and a method notes the force of one of them, so that a force that falls
    from the start on or rises until the end would be missed by some methods and not by others.
    """
    bottles = run.frames[-1].bottles
    largest = bottles.peak_force.copy()
    for frame in run.frames:
        contacts = frame.contacts
        pairs = contacts.kind == BOTTLE_BOTTLE
        ids = np.concatenate([contacts.a, contacts.b[pairs]])
        forces = np.concatenate([contacts.normal_force, contacts.normal_force[pairs]])
        there = np.isin(ids, bottles.id)
        np.maximum.at(largest, np.searchsorted(bottles.id, ids[there]), forces[there])
    return largest


class _Pool:
    """Values and true values of one quantity."""

    def __init__(self) -> None:
        self._errors: list[F8] = []
        self._true: list[F8] = []

    def add(self, values: F8, true: F8) -> None:
        self._errors.append(values - true)
        self._true.append(true)

    @property
    def error(self) -> float:
        """RMS of the errors."""
        return rms(self._errors)

    @property
    def largest(self) -> float:
        return max((float(np.abs(part).max(initial=0.0)) for part in self._errors), default=0.0)

    @property
    def relative(self) -> float:
        """RMS of the errors over that of the true values; 0 where there is nothing to err in."""
        error = self.error
        if error == 0.0:
            return 0.0
        size = rms(self._true)
        return error / size if size > 0.0 else math.inf


def rms(parts: Iterable[F8]) -> float:
    """Root of the mean square over all entries of some arrays; 0 without any."""
    values = np.concatenate([np.zeros(0), *parts])
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else 0.0
