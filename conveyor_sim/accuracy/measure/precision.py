# SPDX-License-Identifier: Apache-2.0
"""Work-precision on a scene: errors and cost of settings over a horizon in which trajectories can be compared."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.accuracy.measure.failures import failure_of, place
from conveyor_sim.accuracy.measure.horizon import HorizonFinder
from conveyor_sim.accuracy.measure.reference import reference_setting, reference_simulation
from conveyor_sim.accuracy.measure.resting import RestingLoad
from conveyor_sim.accuracy.measure.starts import Start, find_starts
from conveyor_sim.accuracy.measure.timing import costs_of
from conveyor_sim.accuracy.results import Errors, Horizon, Point, Reference, Rest
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.accuracy.trajectory import BOTTLE_BOTTLE, Trajectory, follow, variant
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.errors import SimulationError
from conveyor_sim.physics.stepping.guard.chatter import ChatterMeter
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

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


STEPS = 48
"""Observed steps: chatter fills half of them, longer than any contact of five or more steps rings."""

LEAST = 0.05
"""Amplitude of chatter, of v_lim, from which it is reported. It settles at 2 (1 - b) of it, b the least stable step
over the one taken, and is 1 and more from twice that on."""


class ChatterProbe:
    """A scene with a setting, in ticks of one step."""

    def __init__(self, scene: Scene, setting: Setting) -> None:
        self.slip_limit = scene.slip_limit
        # A tick is a whole number of nanoseconds.
        step = max(1, round(scene.tick_ns / setting.per_tick)) * 1e-9
        supply = {name: "off" for name, there in (("infeed", scene.givers()), ("outfeed", scene.exits())) if any(there)}
        single = replace(setting, per_tick=1)
        self._simulation = variant(scene, single, tick=round(step, 9), duration=round(step, 9), effects=supply)

    def look(self, state: Simulation) -> str:
        """One sentence if the setting chatters from a state of the scene on, which stays as it is; else empty."""
        simulation = self._simulation
        simulation.restore_from(state)
        bottles = simulation.bottles()
        radius = simulation.model.type_radius[bottles.type]
        meter = ChatterMeter()
        for _ in range(STEPS):
            try:
                simulation.advance()
            except SimulationError:
                return ""
            now = simulation.bottles()
            meter.note(now.vx, now.vy, radius * now.omega)
        worst, amplitude = meter.worst()
        if amplitude <= LEAST * self.slip_limit:
            return ""
        share = amplitude / self.slip_limit
        return (
            f"chattering: {place(bottles, worst)} shakes by {share:.2g} of slip_limit at every step at {state.time:g} s"
        )


LONGEST = 0.5
"""s, simulated: no horizon is longer."""

MOST_WORK = 5e6
"""Bottle steps of all horizons at the preset `standard`; candidates and reference take some two hundred times that."""

FIRST_WORK = 1e6
"""Work for the first settings: a crowd is compared over shorter horizons first, so that an answer comes soon."""

COST_BUDGET = 20.0
"""s that measuring costs may take."""

FIRST_COST_BUDGET = 2.0
"""Budget for the costs of the first settings, which are measured again with the others."""

Progress = Callable[[float, float], None]
"""Called with what is done so far and the whole."""


@dataclass
class _Trial:
    """Result of the runs of a setting."""

    failure: str
    errors: Errors | None = None
    simulation: Simulation | None = None
    rested: bool = False
    """True if resting load was measured."""
    resting: float | None = None


class WorkPrecision:
    """Compares settings on a scene, which must run at the preset `standard`.

    To be called in this order: `find_starts`, `find_horizons`, `make_reference`, then `try_out` and `points`, or both
    as `measure`, as often as there are settings; `find_rest` and `make_resting_reference` come before the settings of
    which resting load is to be looked at. Each reports its progress. SceneError or SimulationError if the scene does
    not run.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.starts: list[Start] = []
        self.moving = ""
        """A sentence on what moving rails did; empty where there are none."""
        self.untouched: float | None = None
        """s, simulated, in which nothing touched anything; None if something did."""
        self.resting = RestingLoad(scene)
        self.horizons: list[Horizon] = []
        self.cut_short = False
        """True if a horizon would be longer with more work."""
        self.reference: Reference | None = None
        self._true: list[Trajectory] = []
        self._trials: dict[Setting, _Trial] = {}

    def find_starts(self, progress: Progress) -> None:
        """Run the scene and keep states of it."""
        found = find_starts(self.scene, progress)
        self.starts, self.moving = found.starts, found.moving
        self.untouched = None if found.touched else found.looked

    def find_rest(self, progress: Progress) -> None:
        """Look for a settled state, from which errors in resting load are measured; progress in simulated s."""
        self.resting.settle(progress)

    def make_resting_reference(self, progress: Progress) -> Rest:
        """Compute the reference of resting forces; progress in runs."""
        resting = self.resting
        if not resting.settled:
            return Rest(resting.reason, None, None, resting.window, 0, 0.0)
        resting.make_reference(progress)
        assert resting.reference is not None
        return Rest(
            resting.reason,
            resting.reference_setting,
            resting.doubt,
            resting.window,
            resting.reference.force.size,
            resting.reference.rms,
        )

    def find_horizons(self, progress: Progress, work: float = MOST_WORK) -> None:
        """Find how far trajectories from each start can be compared; progress in starts.

        work: bottle steps of all horizons at the preset `standard`. Results of earlier trials are discarded.
        """
        finder = HorizonFinder.of(self.scene)
        bottles = sum(max(1, start.simulation.counts.present) for start in self.starts)
        longest = round(LONGEST / self.scene.tick)
        most = max(1, min(longest, round(work / (bottles * finder.coarse.model.steps_per_tick))))
        self.horizons, self._trials = [], {}
        for start in self.starts:
            progress(len(self.horizons), len(self.starts))
            self.horizons.append(finder.find(start, most))
        progress(len(self.starts), len(self.starts))
        ends = most * self.scene.tick
        self.cut_short = most < longest and any(horizon.length >= ends for horizon in self.horizons)

    def make_reference(self, progress: Progress) -> Reference:
        """Compute the reference trajectories and their uncertainty; progress in runs."""
        setting = reference_setting(self.scene)
        doubtful = replace(
            setting,
            per_tick=max(1, setting.per_tick // 2),
            error=None if setting.error is None else 10.0 * setting.error,
        )
        runs: list[Trajectory] = []
        for one in (doubtful, setting):
            simulation = reference_simulation(self.scene, one)
            for index, start in enumerate(self.starts):
                progress(len(runs), 2 * len(self.starts))
                runs.append(self._follow(simulation, index, start))
                if runs[-1].broken:
                    raise SimulationError(f"the reference: {runs[-1].broken}")
        progress(len(runs), len(runs))
        doubted, self._true = runs[: len(self.starts)], runs[len(self.starts) :]
        self.reference = Reference(setting, errors_of(list(zip(doubted, self._true, strict=True))))
        return self.reference

    def measure(self, settings: Sequence[Setting], progress: Progress) -> list[Point]:
        """Errors and cost of settings, or why they fail; progress in settings, each run and then timed.

        A setting of another stiffness is compared from the start before the first contact alone: the others are no
        states of its.
        """
        whole = 2 * len(settings)
        self.try_out(settings, lambda done, _: progress(done, whole))
        return self.points(settings, COST_BUDGET, lambda done, of: progress(len(settings) * (1.0 + done / of), whole))

    def try_out(
        self, settings: Sequence[Setting], progress: Progress, enough: Callable[[], bool] = lambda: False
    ) -> list[Setting]:
        """Run settings, but for what was run before; progress in settings. Returns those left out once it is enough."""
        for done, setting in enumerate(settings):
            progress(done, len(settings))
            if enough():
                return [left for left in settings[done:] if left not in self._trials]
            trial = self._trials.get(setting) or self._run(setting)
            self._trials[setting] = trial
            self._look_at_rest(trial, setting)
        progress(len(settings), len(settings))
        return []

    def points(self, settings: Sequence[Setting], budget: float, progress: Progress) -> list[Point]:
        """Return the results of settings that were tried, with their costs, measured in turns within a budget (s)."""
        tried = [(setting, self._trials[setting]) for setting in settings if setting in self._trials]
        running = {setting: trial.simulation for setting, trial in tried if trial.simulation is not None}
        costs = costs_of(running, self.starts[-1].simulation, budget, progress)
        return [
            Point(
                setting=setting,
                dt=setting.dt(self.scene),
                predicted=None,
                errors=trial.errors,
                cost=costs.get(setting),
                failure=trial.failure,
                resting=trial.resting,
            )
            for setting, trial in tried
        ]

    def _run(self, setting: Setting) -> _Trial:
        simulation = variant(self.scene, setting)
        runs, failure = self._runs(simulation, setting)
        return _Trial(failure) if failure else _Trial("", errors_of(runs), simulation)

    def _look_at_rest(self, trial: _Trial, setting: Setting) -> None:
        """Once there is a reference; a setting that stops the run then has failed."""
        if trial.simulation is None or trial.rested or self.resting.reference is None:
            return
        trial.rested = True
        try:
            trial.resting = self._resting(trial.simulation, setting)
        except SimulationError as error:
            trial.failure, trial.errors, trial.simulation = f"{error.kind}: {error}", None, None

    def _follow(self, simulation: Simulation, index: int, start: Start) -> Trajectory:
        """From a start over its horizon and a tick, which `errors_of` wants besides."""
        return follow(simulation, start.simulation, round(self.horizons[index].length / self.scene.tick) + 1)

    def _runs(self, simulation: Simulation, setting: Setting) -> tuple[list[tuple[Trajectory, Trajectory]], str]:
        """Return the runs of a setting paired with those of the reference, and the reason of a failure."""
        probe = ChatterProbe(self.scene, setting)
        runs = []
        for index, (start, true) in enumerate(zip(self.starts, self._true, strict=True)):
            if setting.stiffness != 1.0 and not start.untouched:
                continue
            run = self._follow(simulation, index, start)
            failure = failure_of(run, true, simulation.model) or probe.look(simulation)
            if failure:
                return [], failure
            runs.append((run, true))
        return runs, ""

    def _resting(self, simulation: Simulation, setting: Setting) -> float | None:
        """Error in resting load; None where nothing rests, and of other stiffness, whose settled state is another."""
        if setting.stiffness != 1.0 or self.resting.reference is None:
            return None
        return self.resting.error_of(simulation)
