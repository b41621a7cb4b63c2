# SPDX-License-Identifier: Apache-2.0
"""Forces reached in a run, compared with the forces that its time step and predicted error assume."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.physics.model import Model
from conveyor_sim.physics.timestep.prediction import deep_warning, deepest, percent
from conveyor_sim.run.queue_check import QueueCheck, QueueWatch
from conveyor_sim.simulation import Simulation

WINDOW = 1.0
"""Time over which loads are averaged, s. Impacts are much shorter."""

HARDER = 1.05
"""Tolerated ratio of reached to expected force, because damping may add to the peak of an impact."""


@dataclass(frozen=True)
class ForceCheck:
    """Largest normal contact force of a run, compared with the expected force."""

    peak_force: float
    """N"""
    expected_force: float
    """Force that the bounds on the time step and the predicted error assume, N."""
    expected_of: str
    """Cause of the expected force, in words."""
    overlap: float
    """Largest overlap over the smaller diameter at the peak force, by the elastic laws of the contacts."""

    @property
    def as_expected(self) -> bool:
        """True if the force stayed within the expected one, with the tolerance HARDER."""
        return self.peak_force <= HARDER * self.expected_force

    @property
    def warning(self) -> str:
        """Sentence on a force beyond the expected one; empty if the force stayed within it."""
        if self.as_expected:
            return ""
        return (
            f"peak force {self.peak_force:.3g} N, above the {self.expected_force:.3g} N of the predicted error: "
            "forces may be less accurate than predicted"
        )

    @property
    def deep_warning(self) -> str:
        """Sentence on an overlap at which the flow is not that of stiff bottles; empty up to it."""
        return deep_warning(self.overlap, f"overlap at the peak force, {self.peak_force:.3g} N")

    @property
    def sentence(self) -> str:
        """Result, in words."""
        expected = f"the {self.expected_force:.3g} N assumed for the predicted error ({self.expected_of})"
        verdict = f"within {expected}" if self.as_expected else f"more than {expected}: the error may be larger"
        return (
            f"peak force {self.peak_force:.3g} N, {verdict}; "
            f"overlap at most {percent(self.overlap)} of the smaller diameter"
        )


@dataclass(frozen=True)
class Pressed:
    """Largest lasting load on a bottle, compared with the load at which explicit contact friction is stable."""

    load: float
    """Half the sum of the normal forces on a bottle, averaged over WINDOW, N: the force of each neighbour in a file."""
    expected: float
    """N"""
    expected_of: str
    """Cause of the expected load, in words."""

    @property
    def as_expected(self) -> bool:
        """True if the load stayed within the expected one."""
        return self.load <= self.expected

    @property
    def warning(self) -> str:
        """Sentence on a load beyond the expected one; empty if the load stayed within it."""
        if self.as_expected:
            return ""
        return (
            f"resting load {self.load:.3g} N, above the {self.expected:.3g} N of stable friction: it may chatter; "
            "friction_solver: implicit or more steps per tick help"
        )

    @property
    def sentence(self) -> str:
        """Result, in words."""
        bound = f"the {self.expected:.3g} N up to which friction in contacts is stable ({self.expected_of})"
        pressed = f"pressed for {WINDOW:g} s with at most {self.load:.3g} N"
        if self.as_expected:
            return f"{pressed}, within {bound}"
        return (
            f"{pressed}, more than {bound}: friction may chatter; friction_solver: implicit or more steps a tick help"
        )


class PressWatch:
    """Measures lasting loads, from the impulses on bottles between two outputs."""

    def __init__(self) -> None:
        self.load: float | None = None
        """Largest load as in `Pressed`, N; None before the first WINDOW has passed, or without impulses."""
        self._began: float | None = None
        self._ids: list[NDArray[np.uint64]] = []
        self._impulses: list[NDArray[np.float64]] = []

    def take(self, time: float, ids: NDArray[np.uint64], impulses: NDArray[np.float64]) -> None:
        """Take the bottles present at a time (s), and the impulses on them since the last call (N s)."""
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
    """Measures the largest contact force and lasting load of a run, at every tick, because outputs reset peaks."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self.force = simulation.peak_force
        """Largest force so far, N; None without the effect `peaks`."""
        self._pressing = PressWatch()
        self._queues = QueueWatch(simulation.model)

    @property
    def queue(self) -> QueueCheck | None:
        """Longest queue with integrator impulses; None with others."""
        return self._queues.check

    @property
    def load(self) -> float | None:
        """Largest lasting load as in `Pressed`, N."""
        return self._pressing.load

    def after_tick(self) -> None:
        """Take the peaks of a tick."""
        simulation = self._simulation
        now = simulation.peak_force
        if now is not None and self.force is not None:
            self.force = max(self.force, now)
            if simulation.due("bottles"):
                bottles = simulation.bottles()
                self._pressing.take(simulation.time, bottles.id, bottles.impulse)
                self._queues.take(simulation.time, bottles)


def achieved(model: Model, peak_force: float | None) -> ForceCheck | None:
    """Return the check of the largest normal contact force (N); None if it is unknown, or no contact can occur."""
    if peak_force is None or not model.impacts:
        return None
    overlap = deepest(model.impacts, peak_force)
    return ForceCheck(peak_force, model.prediction.force, model.prediction.force_reason, overlap)


def pressed(model: Model, load: float | None) -> Pressed | None:
    """Return the check of the largest lasting load (N); None if no bound on the time step depends on it."""
    if load is None or not any(bound.name == "contact friction" for bound in model.bounds):
        return None
    return Pressed(load, model.load.force, model.load.reason)
