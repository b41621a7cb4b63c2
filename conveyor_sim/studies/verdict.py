"""Which points of a study are the best, and which can't be told from them: in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from conveyor_sim.statistics.comparisons import best
from conveyor_sim.studies.results import Results
from conveyor_sim.studies.row import Row, point_text

MOST = 100
"""Points that are compared, each with each."""
LISTED = 3


def verdicts(results: Results) -> Iterator[str]:
    """For each metric, by pairs of runs with the same seed, corrected for being so many comparisons.

    Of a study with one run a point, instead: which metrics that run alone has no interval for.
    """
    if results.one_run_each:
        yield from _of_single_runs(results)
        return
    by_point: dict[int, dict[int, Row]] = {}
    for row in results.rows:
        if row.status == "finished":
            by_point.setdefault(row.point, {})[row.seed] = row
    seeds = set.intersection(*map(set, by_point.values())) if by_point else set()
    if not 2 <= len(by_point) <= MOST or len(seeds) < 2:
        return
    rows = [[by_point[point][seed] for seed in sorted(seeds)] for point in sorted(by_point)]
    for metric in results.units:
        values = [np.array([row.metrics[metric] for row in found]) for found in rows]
        if not np.isfinite(values).all():
            continue
        sides = {word: best(values, highest=word == "highest") for word in ("lowest", "highest")}
        if len(sides["highest"]) == len(rows):
            yield f"{metric}: no point can be told from another with {len(seeds)} seeds"
            continue
        for word, (top, *others) in sides.items():
            like = _points([rows[place][0] for place in others])
            rest = f"; not told from it with {len(seeds)} seeds: {like}" if others else ""
            yield f"{metric}: {word} at {point_text(rows[top][0].parameters)}{rest}"


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


def _points(rows: Sequence[Row]) -> str:
    """Some of them, and how many more there are."""
    more = f" and {len(rows) - LISTED} more points" if len(rows) > LISTED else ""
    return "; ".join(point_text(row.parameters) for row in rows[:LISTED]) + more
