# SPDX-License-Identifier: Apache-2.0
"""A study from its first run to its last: batches of runs, and between them the decision which points need more."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

from conveyor_sim.statistics.intervals import mean_interval
from conveyor_sim.studies.design import Point, points_of
from conveyor_sim.studies.origin import fingerprint
from conveyor_sim.studies.row import Job, RunRow
from conveyor_sim.studies.runs import Progress, Runs
from conveyor_sim.studies.setup import Setup
from conveyor_sim.studies.study import Seeds, Until


def study_folder(setup: Setup) -> Path:
    """Return the default folder of a study."""
    return Path("runs") / f"study_{setup.study.name}_{fingerprint(setup)}"


def sweep(runs: Runs, setup: Setup, progress: Progress = lambda *_: None) -> list[RunRow]:
    """All runs of a study, point by point, those of a point in the order of their seeds.

    Decisions fall between batches, by the runs of each point in the order of their seeds: never by which was finished
    first. Raises StudyError as `Runs.run`.
    """
    points, seeds = points_of(setup.study), setup.study.seeds
    rows: dict[int, list[RunRow]] = {number: [] for number in range(len(points))}
    for batch in _batches(seeds):
        open_points = [number for number, found in rows.items() if not _enough(found, seeds.until)]
        # By seed first, so that what there is of an unfinished batch is of all points.
        jobs = [Job(number, points[number], seed) for seed in batch for number in open_points]
        for row in runs.run(jobs, progress):
            rows[row.point].append(row)
        if seeds.until is not None and not open_points:
            break
    return [row for number in range(len(points)) for row in sorted(rows[number], key=lambda row: row.seed)]


def jobs_at_least(points: Sequence[Point], seeds: Seeds) -> int:
    """Return the least number of runs."""
    return len(points) * (seeds.count if seeds.count is not None else seeds.batch)


def _batches(seeds: Seeds) -> Iterator[range]:
    if seeds.count is not None:
        yield range(seeds.first, seeds.first + seeds.count)
        return
    for done in range(0, seeds.most, seeds.batch):
        yield range(seeds.first + done, seeds.first + min(done + seeds.batch, seeds.most))


def _enough(rows: Sequence[RunRow], until: Until | None) -> bool:
    """Return True if the interval of the mean is narrow enough."""
    if until is None or not rows:
        return False
    values = [row.metrics[until.metric] for row in rows if row.status == "finished"]
    values = [value for value in values if math.isfinite(value)]
    if len(values) < 2:
        return len(values) < len(rows)  # that fail: more of them would, too
    found = mean_interval(values, until.confidence)
    return found.half_width <= until.half_width * (abs(found.mean) if until.relative else 1.0)
