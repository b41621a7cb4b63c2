# SPDX-License-Identifier: Apache-2.0
"""Comparison horizon of trajectories: contact systems are chaotic, so a small difference grows without bound.

A nudge moves bottles and leaves their velocities. Its growth is measured by the RMS distance of bottles that are
present in both runs. Free flight alone does not count, because it preserves a difference of positions. A difference of
velocities after a collision counts with the time for which it has separated bottles. A scatterer of radius R turns a
difference d into d (1 + 2 L / R) after a flight of length L.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.accuracy.candidates import standard_steps
from conveyor_sim.accuracy.measure.reference import reference_setting, reference_simulation, with_explicit_friction
from conveyor_sim.accuracy.measure.starts import Start
from conveyor_sim.accuracy.results import Horizon
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.accuracy.trajectory import displace, variant
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.errors import SimulationError
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

NUDGE = 1e-12
"""m, of every bottle, in a random direction; rounding moves bottles by 1e-14 over ten thousand steps."""

GROWTH = 2.0
"""Amplification that ends a horizon: an error is then that of the steps, not what later impacts have made of it."""

JUMP = 1e3
"""Growth of one bottle's difference within a tick that no scatterer makes: the nudge has decided whether two things
touch, at first touch the force jumps (the paper's dashpot even drags a bottle along a rail that it touches by 1e-14 m),
and the difference is that of the jump, however small the nudge. Such a bottle is not looked at from then on."""

EARLY = 0.25
"""Fraction of the horizon by the nudge after which the error of the coarse setting is evaluated."""

LEAST_ERROR = 1e-11
"""m, RMS: below it the coarse setting has not erred yet, and there is nothing to watch grow."""

ERROR = 1e-12
"""m/s, of a step of the runs in which a nudge is watched."""


@dataclass(frozen=True, eq=False)
class HorizonFinder:
    """The Simulations that horizons of a scene are found with."""

    tick: float
    """s"""
    coarse: Simulation
    fine: Simulation
    nudged: Simulation

    @classmethod
    def of(cls, scene: Scene) -> "HorizonFinder":
        """For a scene: nudges are watched in runs that are exact enough not to nudge bottles themselves.

        Equal steps are not, however short: where the force jumps at first touch by c v, a bottle that comes later by a
        part of a step leaves faster by that part of c v dt / m, and a nudge d changes the speed by c d / m. Friction is
        explicit in all runs, so that a horizon does not depend on the solver, whose errors it is to compare.
        """
        scene = with_explicit_friction(scene)
        setting = reference_setting(scene)
        fine = replace(setting, error=None if setting.error is None else ERROR)
        coarse = Setting("leapfrog", standard_steps(scene))
        return cls(
            scene.tick,
            variant(scene, coarse),
            reference_simulation(scene, fine),
            reference_simulation(scene, fine),
        )

    def find(self, start: Start, most: int) -> Horizon:
        """Return the horizon from a start: at least one tick, at most `most` ticks."""
        begin = start.simulation
        bottles = begin.bottles()
        angle = np.random.default_rng(0).uniform(0.0, 2.0 * np.pi, bottles.id.size)
        nudge = NUDGE * np.stack([np.cos(angle), np.sin(angle)])
        by_nudge = self._growth(begin, nudge, most)
        by_error = self._growth_of_error(begin, max(1, round(EARLY * (by_nudge or most))), most)
        ticks = min([most, *(grown - 1 for grown in (by_nudge, by_error) if grown is not None)])
        return Horizon(
            start=begin.time,
            bottles=bottles.id.size,
            contacts=begin.contacts().a.size,
            by_nudge=np.inf if by_nudge is None else by_nudge * self.tick,
            by_error=np.inf if by_error is None else by_error * self.tick,
            length=max(1, ticks) * self.tick,
        )

    def _growth_of_error(self, begin: Simulation, early: int, most: int) -> int | None:
        """Ticks until the coarse setting's own error after an early part has grown by GROWTH; None: not in `most`."""
        self.coarse.restore_from(begin)
        self.fine.restore_from(begin)
        try:
            self.coarse.advance(early)
            self.fine.advance(early)
        except SimulationError:
            return early
        error = np.nan_to_num(_apart(self.coarse, self.fine, self.fine.bottles().id))
        if _rms(np.hypot(*error)) < LEAST_ERROR:
            return None
        # Of the two, only its state is needed from here on.
        middle = self.coarse
        middle.restore_from(self.fine)
        grown = self._growth(middle, error, most - early)
        return None if grown is None else early + grown

    def _growth(self, begin: Simulation, shift: F8, most: int) -> int | None:
        """Ticks until a displacement (2, bottles) has grown by GROWTH; None: not in `most` ticks."""
        self.fine.restore_from(begin)
        self.nudged.restore_from(begin)
        displace(self.nudged, shift[0], shift[1])
        ids, size = begin.bottles().id, _rms(np.hypot(*shift))
        before, smooth = np.hypot(*shift), np.full(ids.size, True)
        for tick in range(1, most + 1):
            try:
                self.fine.advance()
                self.nudged.advance()
            except SimulationError:
                return tick
            apart = np.hypot(*_apart(self.nudged, self.fine, ids))
            smooth &= ~(apart > JUMP * np.fmax(before, size))
            if smooth.any() and _rms(apart[smooth]) >= GROWTH * size:
                return tick
            before = apart
        return None


def _apart(one: Simulation, other: Simulation, ids: NDArray[np.uint64]) -> F8:
    """Return the positions in one simulation minus those in another, (2, ids), m; NaN for bottles absent in either."""
    a, b = one.bottles(), other.bottles()
    both, here, there = np.intersect1d(a.id, b.id, assume_unique=True, return_indices=True)
    apart = np.full((2, ids.size), np.nan)
    _, mine, found = np.intersect1d(both, ids, assume_unique=True, return_indices=True)
    apart[0, found] = (a.x[here] - b.x[there])[mine]
    apart[1, found] = (a.y[here] - b.y[there])[mine]
    return apart


def _rms(lengths: F8) -> float:
    """Root of the mean square of those that are known; 0 if none is."""
    known = lengths[~np.isnan(lengths)]
    return float(np.sqrt(np.mean(known**2))) if known.size else 0.0
