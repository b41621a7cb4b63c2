"""Errors of runs against reference runs, pooled over starts."""

import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.accuracy.energy import BOTTLE_BOTTLE
from conveyor_sim.accuracy.results import Errors
from conveyor_sim.accuracy.trajectory import Trajectory
from conveyor_sim.engine.arrays.types import F8

Ids = NDArray[np.uint64]

HORIZON, LATER = -2, -1
"""Frames of a run: at its horizon, and a tick beyond."""


def errors_of(runs: Sequence[tuple[Trajectory, Trajectory]]) -> Errors:
    """Errors of pairs (run, reference run), each from one start over the same ticks, the last one beyond the horizon.

    Bottles that only one run of a pair has, for it was fed or removed a tick earlier there, are left out.
    """
    distances, forces, impulses, energies = _Pool(), _Pool(), _Pool(), _Pool()
    for run, reference in runs:
        # The start itself is common to both.
        for mine, true in zip(run.frames[1:LATER], reference.frames[1:LATER], strict=True):
            a, b = mine.bottles, true.bottles
            _, here, there = np.intersect1d(a.id, b.id, assume_unique=True, return_indices=True)
            distances.add(np.hypot(a.x[here] - b.x[there], a.y[here] - b.y[there]))
            whole = true.energies[there].sum(keepdims=True)
            energies.add(mine.energies[here].sum(keepdims=True) - whole, whole)
        forces.add(*_at_the_end(run, reference, _largest_forces))
        impulses.add(*_at_the_end(run, reference, _impulses))
    return Errors(
        position_rms=distances.error,
        position_max=distances.largest,
        peak_force=forces.relative,
        impulse=impulses.relative,
        energy=energies.relative,
    )


def _at_the_end(
    run: Trajectory, reference: Trajectory, of: Callable[[Trajectory, int], tuple[Ids, F8]]
) -> tuple[F8, F8]:
    """Errors and true values of something that adds up from the start on, for bottles that both runs have.

    An impact that is over just before the horizon in one run is so just after it in the other: what agrees best counts,
    of the values there and a tick later in either.
    """
    ids, true = of(reference, HORIZON)
    mine, later, true_later = (_for(ids, *of(*which)) for which in ((run, HORIZON), (run, LATER), (reference, LATER)))
    errors = np.array([mine - true, later - true, mine - true_later])
    best = np.where(np.isnan(errors), np.inf, np.abs(errors)).argmin(axis=0)
    both = ~np.isnan(mine)
    return np.take_along_axis(errors, best[None], axis=0)[0][both], true[both]


def _largest_forces(run: Trajectory, end: int) -> tuple[Ids, F8]:
    """Bottles of a frame, and the largest normal force of any one contact of each until then, N.

    With those at ticks: a step has two ends, and a method notes the force of one of them, so that a force that falls
    from the start on or rises until the end would be missed by some methods and not by others.
    """
    bottles = run.frames[end].bottles
    largest = bottles.peak_force.copy()
    for frame in run.frames[: len(run.frames) + end + 1]:
        contacts = frame.contacts
        pairs = contacts.kind == BOTTLE_BOTTLE
        ids = np.concatenate([contacts.a, contacts.b[pairs]])
        forces = np.concatenate([contacts.normal_force, contacts.normal_force[pairs]])
        there = np.isin(ids, bottles.id)
        np.maximum.at(largest, np.searchsorted(bottles.id, ids[there]), forces[there])
    return bottles.id, largest


def _impulses(run: Trajectory, end: int) -> tuple[Ids, F8]:
    """Bottles of a frame, and the impulse of all normal forces of each until then, N s."""
    bottles = run.frames[end].bottles
    return bottles.id, bottles.impulse


def _for(ids: Ids, given: Ids, values: F8) -> F8:
    """Values of some bottles in the order of `ids`, (ids,); NaN for those that have none."""
    _, here, there = np.intersect1d(ids, given, assume_unique=True, return_indices=True)
    found = np.full(ids.size, np.nan)
    found[here] = values[there]
    return found


class _Pool:
    """Errors and true values of one quantity."""

    def __init__(self) -> None:
        self._errors: list[F8] = []
        self._true: list[F8] = []

    def add(self, errors: F8, true: F8 | None = None) -> None:
        self._errors.append(errors)
        if true is not None:
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
