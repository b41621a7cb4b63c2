# SPDX-License-Identifier: Apache-2.0
"""Best points of a study, and those that don't differ significantly from them, in sentences."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from conveyor_sim.statistics.comparisons import best, compare_paired
from conveyor_sim.statistics.intervals import mean_interval, runs_for
from conveyor_sim.statistics.words import plus_minus, rounded
from conveyor_sim.studies.results import Results
from conveyor_sim.studies.row import RunRow, point_text

MOST = 100
"""Most points that are compared pairwise."""
LISTED = 3


def verdicts(results: Results) -> Iterator[str]:
    """Yield one sentence per metric and side: the best point, and those that don't differ significantly from it.

    Points are compared by pairs of runs with the same seed, corrected for multiple comparisons. With one run per point,
    yield instead the metrics without an interval. With `seeds: until`, first yield points with wider intervals.
    """
    if results.one_run_each:
        yield from _of_single_runs(results)
        return
    yield from wider_than_wanted(results)
    by_point = _by_point(results)
    seeds = set.intersection(*map(set, by_point.values())) if by_point else set()
    if len(by_point) < 2:
        return
    if len(by_point) > MOST:
        yield f"the {len(by_point)} points are not compared with each other: they are more than {MOST}"
        return
    if len(seeds) < 2:
        yield "the points are not compared with each other: not two seeds have a finished run at each of them"
        return
    rows = [[by_point[point][seed] for seed in sorted(seeds)] for point in sorted(by_point)]
    for metric in results.units:
        values = [np.array([row.metrics[metric] for row in found]) for found in rows]
        if not np.isfinite(values).all():
            lacking = [found[0] for found, made in zip(rows, values, strict=True) if not np.isfinite(made).all()]
            yield f"{metric}: points are not compared, as there are runs without it at {_points(lacking)}"
            continue
        if not any(pair.told for pair in compare_paired(values)):
            yield f"{metric}: no two points differ significantly with {len(seeds)} seeds"
            continue
        sides = {word: best(values, highest=word == "highest") for word in ("lowest", "highest")}
        for word, (top, *others) in sides.items():
            like = _points([rows[place][0] for place in others])
            rest = f"; no significant difference with {len(seeds)} seeds: {like}" if others else ""
            yield f"{metric}: {word} at {point_text(rows[top][0].parameters)}{rest}"


def wider_than_wanted(results: Results) -> Iterator[str]:
    """Yield the points whose intervals are wider than `seeds: until` requires, because `most` was reached."""
    until = results.until
    if until is None or until.metric not in results.units:
        return
    said = []
    for found in _by_point(results).values():
        interval = mean_interval([row.metrics[until.metric] for row in found.values()], until.confidence)
        wanted = until.half_width * (abs(interval.mean) if until.relative else 1.0)
        if math.isfinite(interval.half_width) and interval.half_width > wanted:
            needed = runs_for(interval, wanted, until.confidence)
            said.append(
                f"{until.metric} at {point_text(next(iter(found.values())).parameters)}: "
                f"{plus_minus(interval, results.unit(until.metric))} with {interval.values} seeds, wider than the "
                f"± {wanted:.3g} that is wanted" + ("" if needed is None else f"; about {rounded(needed)} would do")
            )
    yield from said[:LISTED]
    if len(said) > LISTED:
        yield f"{until.metric}: wider than wanted at {len(said) - LISTED} more points"


def _of_single_runs(results: Results) -> Iterator[str]:
    rows = [row for row in results.rows if row.status == "finished"]
    averaged = [metric for metric in results.units if any(metric in row.half_widths for row in rows)]
    if averaged:
        yield f"one run a point: the intervals, of {', '.join(averaged)}, are by batch means of that run"
    for metric in averaged:
        if lacking := [row for row in rows if row.half_widths.get(metric) is None]:
            yield (
                f"{metric}: no interval at {_points(lacking)}: the run is too short for its batches to be independent, "
                "expected a longer run, or more seeds"
            )


def _by_point(results: Results) -> dict[int, dict[int, RunRow]]:
    """Finished runs, by point and seed."""
    found: dict[int, dict[int, RunRow]] = {}
    for row in results.rows:
        if row.status == "finished":
            found.setdefault(row.point, {})[row.seed] = row
    return found


def _points(rows: Sequence[RunRow]) -> str:
    """Return the names of some points, and the number of further ones."""
    more = f" and {len(rows) - LISTED} more points" if len(rows) > LISTED else ""
    return "; ".join(point_text(row.parameters) for row in rows[:LISTED]) + more
