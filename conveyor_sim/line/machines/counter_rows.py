# SPDX-License-Identifier: Apache-2.0
"""Rows of production counters, from sums of devices over an interval."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np

from conveyor_sim.columns.counters import LINE
from conveyor_sim.line.machines.efficiency import CATEGORIES, CycleSums, efficiency

TEXTS = ("name", "category", "stop_reason")
"""Columns that hold texts."""


class DeviceSums(NamedTuple):
    """Sums of one device over an interval."""

    counted: tuple[int, int, int, int]
    """Bottles processed, defective and rejected, and failures."""
    cycles: float
    """Completed cycles. Of one that had begun before the interval: the part within it."""
    set_cycles: float
    """Cycles at the set rate in the time running."""
    times: Mapping[str, float]
    """Time by category, s."""
    nominal: float
    """Nominal rate, 1/s; NaN without one."""
    reference: float
    """Fastest permitted rate, 1/s; NaN without one."""


def line_row(
    since: int, counted: tuple[int, int, int], slowest: Sequence[DeviceSums], counts_starts: bool = False
) -> dict[str, Any]:
    """Return the row of the line: its bottles; times, failures and cycles of the machines of the bottleneck.

    Each machine counts by its share of their fastest permitted rate. counted: bottles that left, defective ones among
    them, and rejected ones. counts_starts: `Scene.counts_starts`.
    """
    left, defective, rejected = counted
    reference = sum(each.reference for each in slowest) if slowest else math.nan
    times: dict[str, float] = dict.fromkeys(CATEGORIES, 0.0)
    for each in slowest:
        for category, time in each.times.items():
            times[category] += time * (1.0 / len(slowest) if counts_starts else each.reference / reference)
    failures = sum(each.counted[3] for each in slowest)
    cycles = float(left) if counts_starts else sum(each.cycles for each in slowest)
    made = left if counts_starts else left + rejected
    set_cycles = sum(each.set_cycles for each in slowest) if slowest else math.nan
    work = CycleSums(cycles, set_cycles, reference, left - defective, made, failures / (len(slowest) or 1))
    nominal = sum(each.nominal for each in slowest) if slowest else math.nan
    return _row(LINE, since, (left, defective, rejected, failures), times, nominal, work)


def counter_row(name: str, since: int, sums: DeviceSums, category: str, stop_reason: str) -> dict[str, Any]:
    """Return the row of one device, as an entry of CounterColumns by field."""
    processed, defective, _, failures = sums.counted
    good = processed - defective
    work = CycleSums(sums.cycles, sums.set_cycles, sums.reference, good, processed, failures)
    return _row(name, since, sums.counted, sums.times, sums.nominal, work, category, stop_reason)


def _row(
    name: str,
    since: int,
    counted: tuple[int, int, int, int],
    times: Mapping[str, float],
    rate: float,
    work: CycleSums,
    category: str = "",
    stop_reason: str = "",
) -> dict[str, Any]:
    """Return an entry of CounterColumns, by field."""
    processed, defective, rejected, failures = counted
    made = efficiency(times, work)
    bottles = {"processed": processed, "good": processed - defective, "defective": defective, "rejected": rejected}
    return {
        "name": name,
        "since": np.uint64(max(since, 0)),
        # Only an edited checkpoint makes these negative.
        **{field: np.uint64(max(value, 0)) for field, value in (bottles | {"failures": failures}).items()},
        **times,
        "rate": rate,
        **{field.name: getattr(made, field.name) for field in fields(made)},
        "oee": made.oee,
        "category": category,
        "stop_reason": stop_reason,
        "rate_limit": work.rate,
    }
