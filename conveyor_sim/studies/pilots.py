"""Pilot runs: how long the warm-up is of a study that says `warm_up: mser`, by rule MSER-5."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from conveyor_sim.errors import StudyError
from conveyor_sim.run.scan_loop import ScanLoop
from conveyor_sim.statistics.warm_up import warm_up
from conveyor_sim.studies.engine import Engine
from conveyor_sim.studies.journal import Journal
from conveyor_sim.studies.line_of import controller_of, scene_of
from conveyor_sim.studies.row import Pilot, RunRow, Status, point_text
from conveyor_sim.studies.run import Work, begun, failure_of, load_kernels, make_tick, reset_counters
from conveyor_sim.support.worker_pool import DiedError

PARTS = 200
"""Equal times that a pilot run is cut into; MSER-5 leaves out whole fives of them."""

SEEDS = 10
"""Pilot runs of a point, at most."""


def find_warm_up(
    works: Sequence[Work],
    engine: Engine,
    journal: Journal,
    say: Callable[[str], object],
    progress: Callable[[int, int, float | None, RunRow | None], None],
) -> float:
    """s: that of the point and metric that take longest, one for all runs, so that they stay pairs.

    works: the runs of the first batch; those with the first SEEDS seeds of a point have pilots. They are kept,
    and so is what they find. Raises StudyError where it can't be said.
    """
    by_point: dict[int, list[Work]] = {}
    for work in sorted(works, key=lambda work: work.job.key):
        by_point.setdefault(work.job.point, []).append(work)
    pilots = [work for point in by_point.values() for work in point[:SEEDS]]
    made = {work.job.key: kept for work in pilots if (kept := journal.pilot_of(work.job)) is not None}
    failed: dict[tuple[int, int], str] = {}
    say(f"warm_up: mser: {len(pilots)} pilot runs find it")
    progress(len(made), len(pilots), None, None)
    for work, found in engine.each(pilot, [work for work in pilots if work.job.key not in made]):
        if isinstance(found, Pilot):
            journal.keep_pilot(work.job, found)
            made[work.job.key] = found
        else:
            status, error = ("lost", str(found)) if isinstance(found, DiedError) else found
            if status == "lost":
                raise StudyError(f"warm_up: mser: a pilot run is lost: {error}; the same command makes it again")
            failed[work.job.key] = error
        progress(len(made) + len(failed), len(pilots), None, None)
    if not made:
        raise StudyError(f"warm_up: mser: no pilot run has finished, expected one at least: {failed[min(failed)]}")
    seconds, where = 0.0, ""
    for point in by_point.values():
        seen = [made[work.job.key] for work in point if work.job.key in made]
        for metric in seen[0].series if seen else ():
            what = f"{metric} at {point_text(point[0].job.parameters)}"
            longest = _warm_up(seen, metric, what)
            if longest > seconds:
                seconds, where = longest, f", which {what} takes"
    journal.keep_warm_up(seconds)
    say(f"warm_up: mser: {seconds:g} s{where}, by {len(made)} pilot runs")
    return seconds


def pilot(work: Work) -> Pilot | tuple[Status, str]:
    """Run without a warm-up, with each metric that settles evaluated for each part of the run separately."""
    try:
        return _pilot(work)
    except Exception as error:  # functions and controllers of the study included
        return failure_of(error)


def _pilot(work: Work) -> Pilot:
    setup, job = work.setup, work.job
    setup.require_same_versions()
    scene = scene_of(setup, job.parameters, job.seed)
    controller = controller_of(setup, job.parameters)
    simulation = begun(scene, work.start)
    load_kernels(simulation)
    ticks = scene.duration_ticks - simulation.tick
    if ticks < PARTS:
        raise StudyError(f"runs of {ticks} ticks given, expected {PARTS} at least to see a warm-up in them")
    scans = ScanLoop(simulation, controller)
    watched = {name: metric.series for name, metric in setup.kept.items() if metric.series is not None}
    series: dict[str, list[float]] = {name: [] for name in watched}
    for _ in range(PARTS):
        reset_counters(simulation)
        gauges = {name: make(simulation) for name, make in watched.items()}
        for _ in range(ticks // PARTS):
            make_tick(simulation, scans, None)
            for gauge in gauges.values():
                gauge.after_tick()
        for name, gauge in gauges.items():
            series[name].append(gauge.value())
    return Pilot(ticks // PARTS * scene.tick, series)


def _warm_up(pilots: Sequence[Pilot], metric: str, what: str) -> float:
    """Return the warm-up of a metric at a point, s, from its mean series over the seeds."""
    part = pilots[0].part
    found = warm_up(np.array([made.series[metric] for made in pilots]))
    if found is None:
        raise StudyError(
            f"warm_up: mser: {what} has not settled by the middle of runs of {part * PARTS:g} s, or they are too few "
            "to tell; expected longer runs, more seeds, or a warm_up in seconds"
        )
    return found * part
