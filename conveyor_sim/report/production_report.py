# SPDX-License-Identifier: Apache-2.0
"""Production report: tables, and figures with their paths."""

from __future__ import annotations

import math
from pathlib import Path

import click
import numpy as np
from rich.box import SIMPLE
from rich.console import Console, Group, RenderableType
from rich.table import Table

from conveyor_sim.columns.counters import CounterColumns
from conveyor_sim.line.machines.efficiency import CATEGORIES, DEFINITIONS
from conveyor_sim.report.alarm_figures import WINDOW, AlarmFigures
from conveyor_sim.report.periods import longest_stops, stop_reasons
from conveyor_sim.report.production import Production, read_production
from conveyor_sim.report.report import can_draw
from conveyor_sim.report.span import Times
from conveyor_sim.support.printable import SENTENCE, printable

MOST = 10
"""Rows of the lists of reasons and of stops."""

FACTORS = {
    "availability": "availability",
    "effectiveness": "effectiveness",
    "at the\nset rate": "set_effectiveness",
    "quality": "quality",
    "OEE": "oee",
}
"""Columns of counters, by heading."""


def render(production: Production) -> Group:
    """Return all tables, that of the line first."""
    parts: list[RenderableType] = [_headline(production), _bottles(production.counters)]
    if production.periods:
        periods = [period for machine in production.periods.values() for period in machine]
        lost = sum(period.length for period in periods if period.category != "running")
        reasons = _table("stopped", "for", "times", "in all, s", "of lost time")
        for entry in stop_reasons(periods)[:MOST]:
            share = _percent(entry.length / lost)
            reasons.add_row(entry.machine, entry.why, str(entry.stops), f"{entry.length:.2f}", share)
        longest = _table("longest stops", "for", "from, s", "length, s")
        for stop in longest_stops(periods, MOST):
            longest.add_row(stop.machine, stop.why, f"{stop.begin:.2f}", f"{stop.length:.2f}")
        counters = production.counters
        parts += [_times(counters), _efficiency(counters), _failures(counters), reasons, longest]
    length = production.end - production.start
    return Group(*parts, *_alarms(production.alarms, length), *([_definitions()] if production.periods else []))


def _headline(production: Production) -> Table:
    counters, rows = production.counters, Table.grid(padding=(0, 2))
    left, good, rejected = (int(column[-1]) for column in (counters.processed, counters.good, counters.rejected))
    rows.add_row("scene", production.scene)
    remark = f" ({production.remark})" if production.remark else ""
    rows.add_row("reported", f"{production.start:.2f} s to {production.end:.2f} s{remark}")
    rows.add_row("bottles", f"{left} left the line, {good} of them good; {rejected} were rejected")
    if counters.bottleneck:
        slowest = " and ".join(printable(name) for name in counters.bottleneck)
        fastest = f"at most {3600.0 * counters.rate_limit[-1]:g} bottles an hour"
        set_rate = f"effectiveness {_percent(counters.set_effectiveness[-1])} at the set rate"
        rows.add_row("bottleneck", f"{slowest}: {fastest}")
        made = f"{_percent(counters.oee[-1])} of the fastest permitted rate; {set_rate}"
        rows.add_row("OEE", made if left else "not known: no bottle has left the line")
    if production.forced:
        more = f" and {len(production.forced) - MOST} more" if len(production.forced) > MOST else ""
        rows.add_row("forced", f"{', '.join(production.forced[:MOST])}{more} (all figures are of the true values)")
    return rows


def _bottles(counters: CounterColumns) -> Table:
    table = _table("bottles", "processed", "good", "defective", "rejected")
    columns = counters.processed, counters.good, counters.defective, counters.rejected
    for row, name in enumerate(counters.name):
        table.add_row(printable(name), *(str(int(column[row])) for column in columns))
    return table


def _times(counters: CounterColumns) -> Table:
    """Shares of the time since the reset."""
    table = _table("share of time", *CATEGORIES)
    for row in _timed(counters):
        times = [float(getattr(counters, category)[row]) for category in CATEGORIES]
        table.add_row(printable(counters.name[row]), *(_percent(time / sum(times)) for time in times))
    return table


def _efficiency(counters: CounterColumns) -> Table:
    """Return the table of ratios derived from times and bottle counts."""
    table = _table("efficiency", *FACTORS)
    for row in _timed(counters):
        ratios = (_percent(getattr(counters, factor)[row]) for factor in FACTORS.values())
        table.add_row(printable(counters.name[row]), *ratios)
    return table


def _failures(counters: CounterColumns) -> Table:
    table = _table("failures", "times", "MTBF, s", "MTTR, s")
    for row in _timed(counters):
        means = (_number(column[row]) for column in (counters.mtbf, counters.mttr))
        table.add_row(printable(counters.name[row]), str(int(counters.failures[row])), *means)
    return table


def _timed(counters: CounterColumns) -> list[int]:
    """Rows of what has times."""
    times = np.sum([getattr(counters, category) for category in CATEGORIES], axis=0)
    return [int(row) for row in np.flatnonzero(times > 0.0)]


def _alarms(alarms: AlarmFigures, length: float) -> list[RenderableType]:
    """Their rate, those that came most often, and those that stand. length: of the recording, s."""
    rows = Table.grid(padding=(0, 2))
    mean = f"{alarms.per_window:.1f} in ten minutes on average, " if length >= WINDOW else ""
    rate = f"{mean}{alarms.most_in_window} at most in ten minutes"
    rows.add_row("alarms", f"{alarms.raised} came, {rate}{': a flood' if alarms.flood else ''}")
    parts: list[RenderableType] = [rows]
    if alarms.by_alarm:
        often = _table("alarm", "times")
        for name, times in list(alarms.by_alarm.items())[:MOST]:
            often.add_row(name, str(times))
        parts.append(often)
    if alarms.standing:
        standing = _table("standing at the end", "for", "since, s")
        for one in alarms.standing[:MOST]:
            standing.add_row(printable(one.id), printable(one.text, SENTENCE), f"{one.since:.2f}")
        parts.append(standing)
    return parts


def _definitions() -> Table:
    rows = Table.grid(padding=(0, 2))
    for name, text in DEFINITIONS.items():
        heading = {"set_effectiveness": "at the set rate"}.get(name, name)
        rows.add_row(name.upper() if name in ("oee", "mtbf", "mttr") else heading, text)
    rows.add_row(
        "line", "times, failures and effectiveness of its bottleneck, quality of all that left or were rejected"
    )
    return rows


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %" if math.isfinite(share) else "-"


def _number(value: float) -> str:
    return f"{value:.{0 if value >= 1e3 else 1}f}" if math.isfinite(value) else "-"


def _table(*headings: str) -> Table:
    table = Table(box=SIMPLE)
    for index, heading in enumerate(headings):
        words = index == 0 or heading == "for"
        table.add_column(heading, justify="left" if words else "right", overflow="fold", no_wrap=not words)
    return table


def report_production(
    bag: Path, out: Path | None, no_pictures: bool, start: float | None = None, stop: float | None = None
) -> None:
    """Print how the line in a recording produced, and draw it into a folder.

    out: None for a folder in that of the recording. start, stop: times to cover, s; None: the end of the warm-up, and
    the end. Raise BagError and ConveyorError as `read_production`, and ConveyorError if a picture can't be written.
    """
    production = read_production(bag, Times(start, stop))
    Console(markup=False, highlight=False).print(render(production))
    folder = out or (bag if bag.is_dir() else bag.parent) / "report"
    if not no_pictures and can_draw():
        from conveyor_sim.report.figures.draw import plot_production

        for picture in plot_production(production, folder):
            click.echo(f"picture: {picture}")
