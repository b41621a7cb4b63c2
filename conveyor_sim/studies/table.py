# SPDX-License-Identifier: Apache-2.0
"""Table of a study so far: one line per point, with the mean and confidence interval of each metric."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from rich.table import Table

from conveyor_sim.statistics.intervals import mean_interval
from conveyor_sim.studies.row import RunRow, number

LONGEST = 40
"""Points that a table on a terminal shows; the file has all."""


def points_table(
    rows: Iterable[RunRow], units: Mapping[str, str], of_parameters: Mapping[str, str], longest: int = LONGEST
) -> Table:
    """Rows of any order; those of failed runs are counted apart. units: of metrics."""
    by_point: dict[int, list[RunRow]] = {}
    for row in rows:
        by_point.setdefault(row.point, []).append(row)
    first = next(iter(by_point.values()), [])
    table = Table(box=None, header_style="bold", padding=(0, 2, 0, 0))
    names = list(first[0].parameters) if first else []
    for name in names:
        table.add_column(with_unit(name, of_parameters.get(name, "")), overflow="fold")
    table.add_column("runs", justify="right")
    for name, unit in units.items():
        table.add_column(with_unit(name, unit), justify="right", overflow="fold")
    for point in sorted(by_point)[:longest]:
        found = by_point[point]
        finished = [row for row in found if row.status == "finished"]
        lacking = len(found) - len(finished)
        runs = f"{len(finished)}" + (f", {lacking} failed" if lacking else "")
        values = [number(found[0].parameters[name]) for name in names]
        table.add_row(*values, runs, *(_mean(finished, name) for name in units))
    if len(by_point) > longest:
        table.add_row(f"and {len(by_point) - longest} more points")
    return table


def with_unit(name: str, unit: str) -> str:
    """Return a name with its unit, as column header or axis label."""
    return name if unit in ("", "1") else f"{name} ({unit})"


def _mean(rows: Sequence[RunRow], metric: str) -> str:
    """Return the mean over the runs of a point with the half-width of its interval.

    The interval is over the seeds, or by batch means for a single run.
    """
    known = [row.metrics[metric] for row in rows if math.isfinite(row.metrics[metric])]
    if not known:
        return "-"
    found = mean_interval(known)
    half = found.half_width if len(known) > 1 else rows[0].half_widths.get(metric) if len(rows) == 1 else None
    if not half:
        return f"{found.mean:.4g}"
    digits = max(0, 1 - math.floor(math.log10(half)))
    return f"{found.mean:.{digits}f} ± {half:.{digits}f}"
