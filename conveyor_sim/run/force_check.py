"""What a run reached, against what its predicted error rests on: forces up to those that were expected."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.physics.model import Model
from conveyor_sim.physics.timestep.prediction import percent
from conveyor_sim.simulation import Simulation

WINDOW = 1.0
"""s, over which loads are means: no impact lasts so long."""

HARDER = 1.05
"""Times the expected force that is still as expected: damping may add to the peak of an impact."""


@dataclass(frozen=True)
class ForceCheck:
    """The largest normal contact force of a run, and what it says."""

    peak_force: float
    """N"""
    expected_force: float
    """N, that the bounds on the time step and the predicted error rest on."""
    expected_of: str
    """What presses so."""
    overlap: float
    """At most so much of the smaller bottle's diameter, by the elastic laws of the contacts that there are."""

    @property
    def as_expected(self) -> bool:
        """Whether the force stayed below what the prediction rests on."""
        return self.peak_force <= HARDER * self.expected_force

    @property
    def sentence(self) -> str:
        """All of it."""
        expected = f"the {self.expected_force:.3g} N that the predicted error rests on ({self.expected_of})"
        verdict = f"within {expected}" if self.as_expected else f"more than {expected}, which may be exceeded, too"
        return (
            f"peak force {self.peak_force:.3g} N, {verdict}; "
            f"overlap at most {percent(self.overlap)} of the smaller diameter"
        )


@dataclass(frozen=True)
class Pressed:
    """What pressed on a bottle for long, against the load that explicit friction in contacts is stable at."""

    load: float
    """N, half of the normal forces on a bottle, as two contacts share them in a file; mean over WINDOW."""
    expected: float
    """N"""
    expected_of: str

    @property
    def as_expected(self) -> bool:
        """Whether the load stayed below what the bound on the time step rests on."""
        return self.load <= self.expected

    @property
    def sentence(self) -> str:
        """All of it."""
        bound = f"the {self.expected:.3g} N that friction in contacts is stable at ({self.expected_of})"
        pressed = f"pressed for {WINDOW:g} s with at most {self.load:.3g} N"
        if self.as_expected:
            return f"{pressed}, within {bound}"
        return (
            f"{pressed}, more than {bound}: friction may chatter; friction_solver: implicit or more steps a tick help"
        )


class PressWatch:
    """What pressed for long, from the impulses that bottles had from one output to the next."""

    def __init__(self) -> None:
        self.load: float | None = None
        """N, as in `Pressed`; None before the first WINDOW has passed, or where impulses are not known."""
        self._began: float | None = None
        self._ids: list[NDArray[np.uint64]] = []
        self._impulses: list[NDArray[np.float64]] = []

    def take(self, time: float, ids: NDArray[np.uint64], impulses: NDArray[np.float64]) -> None:
        """At a time in s: bottles, and what they were pushed by since the last call, N s."""
        if self._began is None:
            self._began = time
            return
        self._ids.append(np.asarray(ids))
        self._impulses.append(np.asarray(impulses))
        passed = time - self._began
        if passed < WINDOW * (1.0 - 1e-9):
            return
        _, which = np.unique(np.concatenate(self._ids), return_inverse=True)
        sums = np.bincount(which, np.concatenate(self._impulses))
        load = 0.5 * float(sums.max(initial=0.0)) / passed
        if math.isfinite(load):
            self.load = max(load, self.load or 0.0)
        self._began, self._ids, self._impulses = time, [], []


class PeakWatch:
    """The largest contact force of a run; looked up after every tick, for peaks begin anew with outputs."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self.force = simulation.peak_force
        """N, so far; None where the scene has no effect `peaks`."""
        self._pressing = PressWatch()

    @property
    def load(self) -> float | None:
        """N, that pressed for long, as in `Pressed`."""
        return self._pressing.load

    def after_tick(self) -> None:
        """Look."""
        simulation = self._simulation
        now = simulation.peak_force
        if now is not None and self.force is not None:
            self.force = max(self.force, now)
            if simulation.due("bottles"):
                bottles = simulation.bottles()
                self._pressing.take(simulation.time, bottles.id, bottles.impulse)


def achieved(model: Model, peak_force: float | None) -> ForceCheck | None:
    """What a run came to with its largest normal contact force (N); None if it is not known, or nothing can touch."""
    if peak_force is None or not model.impacts:
        return None
    overlap = max(impact.overlap(peak_force) / impact.diameter for impact in model.impacts)
    return ForceCheck(peak_force, model.prediction.force, model.prediction.force_reason, overlap)


def pressed(model: Model, load: float | None) -> Pressed | None:
    """What pressed for long (N) beside what was expected; None where no bound on the time step rests on it."""
    if load is None or not any(bound.name == "contact friction" for bound in model.bounds):
        return None
    return Pressed(load, model.load.force, model.load.reason)
