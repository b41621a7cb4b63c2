# SPDX-License-Identifier: Apache-2.0
"""Metrics against parameters: means over seeds and points, main effects, interactions, Sobol indices."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from conveyor_sim.errors import StudyError
from conveyor_sim.scene import parse_overrides
from conveyor_sim.statistics.intervals import mean_interval
from conveyor_sim.studies.code import require_package
from conveyor_sim.studies.design import salib_problem
from conveyor_sim.studies.figures.data import Indices, Map, Response
from conveyor_sim.studies.results import Results
from conveyor_sim.studies.row import RunRow, number
from conveyor_sim.studies.table import with_unit

MOST_LEVELS = 40
"""Most levels of a parameter. With more, its points are scattered, and hardly any two share a value."""


def main_effects(results: Results) -> list[list[list[Response]]]:
    """By metric, then by parameter: the mean at each of its levels, over all else."""
    return [[[response(results, parameter, metric)] for parameter in results.parameters] for metric in results.units]


def interactions(results: Results, metric: str) -> list[list[list[Response]]]:
    """Return one row per pair of parameters: the metric over each of them, with a line per level of the other."""
    panels = []
    for pair in combinations(_levelled(results), 2):
        panels.append([_lines(results, metric, *pair), _lines(results, metric, *pair[::-1])])
    return panels


def maps(results: Results) -> dict[str, Map]:
    """Return each metric over both parameters, for a study of two parameters with levels."""
    if len(results.parameters) != 2 or len(_levelled(results)) != 2:
        return {}
    one, other = results.parameters
    levels = levels_of(results.rows, one), levels_of(results.rows, other)
    by_metric = {}
    for metric in results.units:
        cells = [
            [_mean(_values(_at(_at(results.rows, one, level), other, also), metric)) for also in levels[1]]
            for level in levels[0]
        ]
        by_metric[metric] = Map(
            (titled(results, one), titled(results, other)), titled(results, metric), levels, np.array(cells)
        )
    return by_metric


def response(results: Results, parameter: str, metric: str, rows: Sequence[RunRow] | None = None) -> Response:
    """Return a metric over the levels of a parameter.

    All points have the same seeds, so runs are grouped by seed: the mean over the points at a level is one value per
    seed, and the interval rests on the number of seeds. A seed that a point at the level lacks, because it has fewer
    runs or a run failed, is left out there: its mean would cover other points than those of the other seeds.
    """
    rows = results.rows if rows is None else rows
    title, across = titled(results, metric), titled(results, parameter)
    if parameter not in _levelled(results):
        points = sorted({row.point: row.parameters[parameter] for row in rows}.items(), key=lambda pair: pair[1])
        means = [_mean(_values([row for row in rows if row.point == point], metric)) for point, _ in points]
        levels = [level for _, level in points]
        return Response(across, title, levels, np.array(means), np.full(len(means), math.nan), scattered=True)
    levels = levels_of(rows, parameter)
    means, halves = [], []
    for level in levels:
        at_level = _at(rows, parameter, level)
        by_point: dict[int, dict[int, float]] = {}
        for row in at_level:
            if row.status == "finished" and math.isfinite(row.metrics[metric]):
                by_point.setdefault(row.point, {})[row.seed] = row.metrics[metric]
        seeds = set.intersection(*map(set, by_point.values())) if by_point else set()
        values = [_mean([by_seed[seed] for by_seed in by_point.values()]) for seed in sorted(seeds)]
        # Without a seed that all have, each point counts as much as another, and nothing is known of the interval.
        means.append(_mean(values or [_mean(list(by_seed.values())) for by_seed in by_point.values()]))
        halves.append(mean_interval(values).half_width if len(values) > 1 else _of_one_run(at_level, metric))
    return Response(across, title, levels, np.array(means), np.array(halves))


def indices(results: Results) -> list[Indices]:
    """First and total Sobol indices of each metric (Saltelli 2010, Jansen 1999, as SALib has them).

    Raises StudyError for a study of another design, with runs missing, or without SALib.
    """
    study = parse_overrides(results.study)
    if study.get("design") != "saltelli":
        raise StudyError("Sobol indices: the study's design is another, expected design: saltelli")
    require_package("SALib", "Sobol indices")
    from SALib.analyze import sobol

    names = list(results.parameters)
    points = int(study["points"]) * (len(names) + 2)
    by_metric = []
    for metric in results.units:
        by_point: dict[int, list[RunRow]] = {}
        for row in results.rows:
            by_point.setdefault(row.point, []).append(row)
        outcome = np.array([_mean(_values(by_point.get(point, []), metric)) for point in range(points)])
        if missing := int(np.count_nonzero(~np.isfinite(outcome))):
            raise StudyError(f"Sobol indices: {missing} of {points} points have no {metric}, expected one of each")
        if outcome.std() == 0.0:
            continue  # nothing to share out
        shares = sobol.analyze(salib_problem(names), outcome, calc_second_order=False, seed=0)
        columns = [np.asarray(shares[key]) for key in ("S1", "S1_conf", "ST", "ST_conf")]
        by_metric.append(Indices(titled(results, metric), names, *columns))
    return by_metric


def titled(results: Results, name: str) -> str:
    """Return a metric or a parameter with its unit."""
    return with_unit(name, {**results.parameters, **results.units}[name])


def levels_of(rows: Iterable[RunRow], parameter: str) -> list[Any]:
    """Numbers in rising order; with texts among them in the order of the points."""
    levels = list(dict.fromkeys(row.parameters[parameter] for row in sorted(rows, key=lambda row: row.point)))
    numbers = all(isinstance(level, (int, float)) and not isinstance(level, bool) for level in levels)
    return sorted(levels) if numbers else levels


def _levelled(results: Results) -> list[str]:
    """Return the parameters with several points per value, or with few values.

    A Saltelli sample has none: its points share values by construction.
    """
    if parse_overrides(results.study).get("design") == "saltelli":
        return []
    points = len({row.point for row in results.rows})
    levels = {name: len(levels_of(results.rows, name)) for name in results.parameters}
    few = len(results.parameters) == 1
    return [name for name, count in levels.items() if count <= MOST_LEVELS and (few or count < points)]


def _lines(results: Results, metric: str, across: str, other: str) -> list[Response]:
    lines = []
    for level in levels_of(results.rows, other):
        line = response(results, across, metric, _at(results.rows, other, level))
        lines.append(replace(line, label=f"{other} {number(level)}"))
    return lines


def _at(rows: Iterable[RunRow], parameter: str, level: Any) -> list[RunRow]:
    return [row for row in rows if row.parameters[parameter] == level]


def _values(rows: Iterable[RunRow], metric: str) -> list[float]:
    return [row.metrics[metric] for row in rows if row.status == "finished"]


def _of_one_run(rows: Sequence[RunRow], metric: str) -> float:
    """Half width by batch means, of a level with a single run; NaN: it has none."""
    half = rows[0].half_widths.get(metric) if len(rows) == 1 else None
    return math.nan if half is None else half


def _mean(values: Sequence[float]) -> float:
    known = [value for value in values if math.isfinite(value)]
    return math.fsum(known) / len(known) if known else math.nan
