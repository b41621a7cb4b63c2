# SPDX-License-Identifier: Apache-2.0
"""Error in resting load: time means of the normal forces in contacts that stay closed, against a reference run.

What presses for long (a queue against a stop, bottles carried along the rim of a turn-table) is a hundred times smaller
than an impact, so that an error pooled over both says nothing of it. All settings start from one settled state of the
scene, in which belts keep running; impacts are left out, for their contacts do not stay closed.

    resting = RestingLoad(scene)
    resting.settle(progress)
    if resting.settled:
        resting.make_reference(progress)
        error = resting.error_of(variant(scene, setting))
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.accuracy.candidates import forbidden, standard_steps
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.accuracy.trajectory import variant
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

WINDOW = 1.0
"""s, over which forces are averaged."""

SETTLED = 0.01
"""Change of the time means from one window to the next, RMS relative, up to which a scene counts as settled."""

IN_A_ROW = 2
"""Windows that must change so little: of two contacts that happen to last, one may agree by chance."""

TICK_WORK = 4e3
"""Bottle steps that cost as much as a tick beside its steps, in round numbers."""

CONTACT_WORK = 50.0
"""Bottle steps that cost as much as to take down a contact's force at a tick."""

LONGER = 2.0
"""Times the scene's duration that it may take to settle: its infeeds and outfeeds go on as in the scene."""

MOST_WORK = 4e8
"""Bottle steps of the run in which the settled state is looked for."""

WINDOW_WORK = 1.5e7
"""Bottle steps of a window at the preset `standard`; windows of scenes that take more are shorter."""

CONVERGED = 1e-5
"""Relative difference of two references, one of half the step, from which on the step is not halved any more."""

HALVINGS = 5
"""The most times that the reference's step is halved."""

FIRST_ORDER = 8
"""Steps in one of the preset `standard` of a fine run, where leapfrog must do for want of another method."""

Progress = Callable[[float, float], None]
"""Called with what is done so far and the whole."""


class RestingLoad:
    """Measures the error in resting load of settings on one scene.

    To be called in this order: `settle`, `make_reference` if it settled, then `error_of` as often as wanted.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.state: Simulation | None = None
        """At the settled state, to be left there; None where there is none."""
        self.reason = ""
        """Time of settling, or the reason why there is no settled state: a sentence without its full stop."""
        self.window = WINDOW
        """s, over which forces are averaged."""
        self.reference: Loads | None = None
        self.reference_setting: Setting | None = None
        self.doubt: float | None = None
        """Relative difference of the reference from that of twice the step."""

    @property
    def settled(self) -> bool:
        """Return True if there is a settled state to start from."""
        return self.state is not None

    def settle(self, progress: Progress) -> None:
        """Run the scene in fine steps until the means of resting contacts stop changing; progress in simulated s.

        The last settled state of the scene's duration is kept, when the line is fullest; where there is none in it, the
        first one after it. Raises SimulationError if the run stops.
        """
        fine = variant(self.scene, fine_setting(self.scene))
        limit, work, steady, rested = LONGER * self.scene.duration, 0.0, 0, False
        before: Loads | None = None
        while fine.time + WINDOW <= limit + 0.5 * self.scene.tick and work < MOST_WORK:
            progress(fine.time, limit)
            now = mean_loads(fine)
            steps = max(1, fine.counts.present) * fine.model.steps_per_tick
            work += (steps + TICK_WORK + CONTACT_WORK * now.force.size) * WINDOW / self.scene.tick
            change = None if before is None else difference(now, before)
            rested = rested or now.force.size > 0
            steady = steady + 1 if change is not None and change <= SETTLED else 0
            before = now
            if steady >= IN_A_ROW:
                self._keep(fine, now)
            if self.settled and fine.time + WINDOW > self.scene.duration:
                break
        progress(limit, limit)
        if self.state is None:
            self.reason = (
                f"the forces that last were still changing at {fine.time:g} s"
                if rested
                else f"no contact stayed closed for {WINDOW:g} s in {fine.time:g} s"
            )

    def make_reference(self, progress: Progress) -> None:
        """Compute the reference loads by halving the step until they no longer change; progress in runs.

        Raise SimulationError if a run stops.
        """
        setting = fine_setting(self.scene)
        progress(0, HALVINGS + 1)
        self.reference, self.reference_setting = self._loads(variant(self.scene, setting)), setting
        for done in range(HALVINGS):
            progress(done + 1, HALVINGS + 1)
            before, setting = self.reference, Setting(setting.integrator, 2 * setting.per_tick)
            self.reference, self.reference_setting = self._loads(variant(self.scene, setting)), setting
            self.doubt = difference(before, self.reference)
            if self.doubt is not None and self.doubt <= CONVERGED:
                break
        progress(HALVINGS + 1, HALVINGS + 1)

    def error_of(self, simulation: Simulation) -> float | None:
        """Relative error in resting load of the scene with a setting; None where no contact stayed closed in both.

        Raises SimulationError if the run stops.
        """
        if self.reference is None:
            raise ValueError("no reference, expected `make_reference` before")
        return difference(self._loads(simulation), self.reference)

    def _keep(self, fine: Simulation, loads: Loads) -> None:
        self.state = variant(self.scene, fine_setting(self.scene))
        self.state.restore_from(fine)
        self.reason = f"settled at {fine.time:g} s, with {loads.force.size} resting contacts of {loads.rms:.3g} N (RMS)"
        work = max(1, fine.counts.present) * standard_steps(self.scene) / self.scene.tick
        self.window = min(WINDOW, max(10.0 * self.scene.tick, WINDOW_WORK / work))

    def _loads(self, simulation: Simulation) -> Loads:
        if self.state is None:
            raise ValueError("no settled state, expected `settle` before, and that it found one")
        return loads_from(simulation, self.state, self.window)


def fine_setting(scene: Scene) -> Setting:
    """Return the steps of the preset `standard` with velocity Verlet (second order); more where it can't run."""
    steps = standard_steps(scene)
    if "velocity_verlet" in forbidden(scene):
        return Setting("leapfrog", FIRST_ORDER * steps)
    return Setting("velocity_verlet", steps)


@dataclass(frozen=True, eq=False)
class Loads:
    """Time means of the normal forces of contacts, each closed at every tick of the time."""

    contact: NDArray[np.int64]
    """(C, 3), ascending: 0 and the ids of two bottles, the lesser first; or 1, a bottle's id and a rail's number."""
    force: F8
    """(C,), N."""

    @property
    def rms(self) -> float:
        """N, root of the mean square over contacts; 0 without any."""
        return _rms(self.force)


def mean_loads(simulation: Simulation, window: float = WINDOW) -> Loads:
    """Run for a time (s, in whole ticks, at least one) and average each contact's normal force over its ticks.

    Pieces of one rail that push together count as one contact. Raises SimulationError if the run stops.
    """
    ticks = _ticks(simulation, window)
    seen: dict[tuple[int, int, int], list[float]] = {}
    for tick in range(ticks):
        simulation.advance()
        for contact, force in _now(simulation).items():
            if tick == 0:
                seen[contact] = [force]
            elif contact in seen and len(seen[contact]) == tick:
                seen[contact].append(force)
    closed = sorted(contact for contact, forces in seen.items() if len(forces) == ticks)
    contacts = np.array(closed, dtype=np.int64).reshape(-1, 3)
    return Loads(contacts, np.array([math.fsum(seen[contact]) / ticks for contact in closed]))


def loads_from(simulation: Simulation, state: Simulation, window: float = WINDOW) -> Loads:
    """`mean_loads` from the state of another Simulation of the same line, which stays as it is.

    Tangential springs, which such a start leaves slack, get another window before to be taut again.
    """
    simulation.restore_from(state)
    if simulation.model.has("tangential_spring"):
        simulation.advance(_ticks(simulation, window))
    return mean_loads(simulation, window)


def resting_error(simulation: Simulation, state: Simulation, reference: Loads, window: float = WINDOW) -> float | None:
    """Relative error in resting load of a Simulation that runs from a settled state; see `difference`."""
    return difference(loads_from(simulation, state, window), reference)


def difference(run: Loads, reference: Loads) -> float | None:
    """RMS of the differences over the RMS of the reference's forces, over contacts closed in both; None without any."""
    here, there = _common(run, reference)
    if not here.size:
        return None
    size = _rms(reference.force[there])
    error = _rms(run.force[here] - reference.force[there])
    return error / size if size > 0.0 else None


def _ticks(simulation: Simulation, window: float) -> int:
    return max(1, round(window / simulation.scene.tick))


def _now(simulation: Simulation) -> dict[tuple[int, int, int], float]:
    """Return the normal force (N) of each contact at this tick."""
    columns = simulation.contacts()
    a, b = columns.a.astype(np.int64), columns.b.astype(np.int64)
    pair = columns.kind == 0
    first, second = np.where(pair, np.minimum(a, b), a), np.where(pair, np.maximum(a, b), b)
    forces: dict[tuple[int, int, int], float] = {}
    rows = zip(columns.kind.tolist(), first.tolist(), second.tolist(), columns.normal_force.tolist(), strict=True)
    for kind, one, other, force in rows:
        forces[kind, one, other] = forces.get((kind, one, other), 0.0) + force
    return forces


def _common(one: Loads, other: Loads) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows of the contacts that two have in common, of each."""
    rows = {tuple(contact): row for row, contact in enumerate(other.contact.tolist())}
    pairs = [(row, rows[key]) for row, key in enumerate(map(tuple, one.contact.tolist())) if key in rows]
    found = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    return found[:, 0], found[:, 1]


def _rms(values: F8) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else 0.0
