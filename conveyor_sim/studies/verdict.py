"""Which points of a study are the best, and which can't be told from them: in sentences."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from conveyor_sim.statistics.comparisons import best
from conveyor_sim.studies.results import Results
from conveyor_sim.studies.row import Row
from conveyor_sim.studies.table import number

MOST = 100
"""Points that are compared, each with each."""
LISTED = 3


def verdicts(results: Results) -> Iterator[str]:
    """For each metric, by pairs of runs with the same seed, corrected for being so many comparisons."""
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
            like = [point_text(rows[place][0]) for place in others[:LISTED]]
            more = f" and {len(others) - LISTED} more points" if len(others) > LISTED else ""
            rest = f"; not told from it with {len(seeds)} seeds: {'; '.join(like)}{more}" if others else ""
            yield f"{metric}: {word} at {point_text(rows[top][0])}{rest}"


def point_text(row: Row) -> str:
    """Its parameters: "length 0.7, speed 0.4"."""
    return ", ".join(f"{name} {number(value)}" for name, value in row.parameters.items())
