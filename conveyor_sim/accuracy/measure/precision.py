"""Work-precision on a scene: errors and cost of settings over a horizon in which trajectories can be compared."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from conveyor_sim.accuracy.measure.chatter import ChatterProbe
from conveyor_sim.accuracy.measure.deviation import errors_of
from conveyor_sim.accuracy.measure.failures import failure_of
from conveyor_sim.accuracy.measure.horizon import HorizonFinder
from conveyor_sim.accuracy.measure.reference import reference_setting, reference_simulation
from conveyor_sim.accuracy.measure.resting import RestingLoad
from conveyor_sim.accuracy.measure.starts import Start, find_starts
from conveyor_sim.accuracy.measure.timing import costs_of
from conveyor_sim.accuracy.results import Errors, Horizon, Point, Reference, Rest
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.accuracy.trajectory import Trajectory, follow, variant
from conveyor_sim.errors import SimulationError
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

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
