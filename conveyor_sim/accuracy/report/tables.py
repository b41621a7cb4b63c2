# SPDX-License-Identifier: Apache-2.0
"""A study as tables: what each says, once, for terminals and as Markdown."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Generic, TypeVar

from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, Group, RenderResult
from rich.table import Table
from rich.text import Text

from conveyor_sim.accuracy.report.answer import foretelling
from conveyor_sim.accuracy.report.lines import three_lines
from conveyor_sim.accuracy.report.pareto import front, place_of
from conveyor_sim.accuracy.report.words import digits, hundredths, percent, setting_name, spread, with_unit
from conveyor_sim.accuracy.results import (
    AccuracyStudy,
    Comparison,
    Cost,
    Errors,
    FlowAnswer,
    FlowRow,
    Horizon,
    Order,
    Point,
    Sample,
    StiffnessRow,
)
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.physics.timestep.prediction import DEEP

Row = TypeVar("Row")


@dataclass(frozen=True)
class Column(Generic[Row]):
    """Column of a table: its header, and its text for a row."""

    heading: str
    """A line or several."""
    text: Callable[[Row], str]
    left: bool = False
    """Alignment: False aligns right, for numbers."""


@dataclass(frozen=True)
class Block:
    """A title, a table and sentences below it; no table where there are no rows.

    Renders for the terminal, and as Markdown.
    """

    title: str
    headings: tuple[str, ...]
    left: tuple[bool, ...]
    groups: tuple[tuple[str, tuple[tuple[str, ...], ...]], ...]
    """Captions, each with the rows below it; an empty caption is not shown."""
    strong: frozenset[tuple[str, ...]]
    """Rows that stand out."""
    notes: tuple[str, ...]

    @staticmethod
    def of(
        title: str,
        columns: Sequence[Column[Row]],
        groups: Mapping[str, Sequence[Row]],
        notes: Iterable[str] = (),
        strong: Callable[[Row], bool] = lambda _: False,
    ) -> Block:
        """Return the block of a table with these columns; groups: rows by caption."""

        def cells(row: Row) -> tuple[str, ...]:
            return tuple(column.text(row) for column in columns)

        return Block(
            title=title,
            headings=tuple(column.heading for column in columns),
            left=tuple(column.left for column in columns),
            groups=tuple((caption, tuple(map(cells, rows))) for caption, rows in groups.items() if rows),
            strong=frozenset(cells(row) for rows in groups.values() for row in rows if strong(row)),
            notes=tuple(notes),
        )

    def markdown(self) -> str:
        """Return the block as Markdown: a third-level heading, the table, and one paragraph per sentence."""
        parts = [f"### {self.title}"]
        if self.groups:
            lines = [_line(self.headings), _line("---" if left else "---:" for left in self.left)]
            for caption, rows in self.groups:
                lines += [_line([f"**{caption}**", *[""] * (len(self.headings) - 1)])] if caption else []
                lines += [_line(f"**{cell}**" if cell and row in self.strong else cell for cell in row) for row in rows]
            parts.append("\n".join(lines))
        return "\n\n".join([*parts, *self.notes]) + "\n"

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """For terminals: all captions share one heading and one set of widths."""
        yield Text(self.title, style="bold")
        yield Text()
        if self.groups:
            widths, gap = self._widths(options.max_width)
            yield self._table(widths, gap, (), heading=True)
            for caption, rows in self.groups:
                yield from [Text(caption, style="italic")] if caption else []
                yield self._table(widths, gap, rows)
                yield Text()
        if self.notes:
            yield from map(Text, self.notes)
            yield Text()

    def _widths(self, room: int) -> tuple[list[int], int]:
        """Characters of each column and of the gap between two; where room lacks, lines break between words, in
        numbers last."""
        lines = [self.headings, *(row for _, rows in self.groups for row in rows)]
        columns = list(zip(*lines, strict=True))
        widths = [max(cell_len(line) for cell in column for line in cell.split("\n")) for column in columns]
        least = [max(cell_len(word) for cell in column for word in ["", *cell.split()]) for column in columns]
        gap = 2 if sum(widths) + 2 * (len(widths) - 1) <= room else 1
        for index in [i for wanted in (True, False) for i, left in enumerate(self.left) if left == wanted]:
            lacking = sum(widths) + gap * (len(widths) - 1) - room
            widths[index] -= max(0, min(lacking, widths[index] - least[index]))
        return widths, gap

    def _table(self, widths: Sequence[int], gap: int, rows: Sequence[tuple[str, ...]], heading: bool = False) -> Table:
        table = Table(box=SIMPLE_HEAD, show_edge=False, show_header=heading, pad_edge=False, padding=(0, gap - 1, 0, 0))
        for text, left, width in zip(self.headings, self.left, widths, strict=True):
            table.add_column(Text(text), justify="left" if left else "right", width=width)
        for row in rows:
            table.add_row(*map(Text, row), style="bold" if row in self.strong else None)
        return table


def _line(cells: Iterable[str]) -> str:
    return "| " + " | ".join(text.replace("|", "\\|").replace("\n", " ") for text in cells) + " |"


Placed = tuple[Point, Errors, Cost]
Quantity = tuple[str, Callable[[StiffnessRow], str]]


def terminal(study: AccuracyStudy) -> Group:
    """All tables of the study for a rich console of 80 columns or more, the answer last."""
    return Group(*blocks(study))


def markdown(study: AccuracyStudy) -> str:
    """Return the tables as Markdown, each below a third-level heading."""
    return "\n".join(block.markdown() for block in blocks(study))


def blocks(study: AccuracyStudy) -> list[Block]:
    """Return the tables for which the study has rows, and the answer."""
    parts = [
        _orders(study.orders),
        _horizons(study),
        *_work(study),
        _failures(study.points),
        _ensembles(study),
        _lost_runs(study),
        _flow(study.flow),
        _stiffness(study.stiffness),
    ]
    kept = [block for block in parts if block.groups]
    if study.skipped:
        kept.append(Block.of("Left out", (), {}, study.skipped))
    return [*kept, _answer(study)]


def _orders(orders: Sequence[Order]) -> Block:
    return Block.of(
        "Closed forms: how fast the error falls with the step",
        [
            Column[Order]("integrator", lambda row: row.integrator, left=True),
            Column("order", lambda row: f"{row.observed:.2f}"),
            Column("expected", lambda row: digits(row.expected)),
            Column("steps", lambda row: _range(map(str, row.steps))),
            Column("error, %", lambda row: _range(digits(100.0 * error) for error in row.errors)),
        ],
        _grouped(orders, lambda row: f"{row.case}: {row.quantity}"),
        [f"Errors are RMS over {_all(row.phases for row in orders)} phases of entry into a step."],
    )


def _horizons(study: AccuracyStudy) -> Block:
    doubt = study.reference.doubt
    return Block.of(
        "How long trajectories can be compared",
        [
            Column[Horizon]("from\ns", lambda row: digits(row.start)),
            Column("bottles", lambda row: str(row.bottles)),
            Column("contacts", lambda row: str(row.contacts)),
            Column("a nudge\ndoubles in, s", lambda row: _later(row.by_nudge)),
            Column("a coarse step's\nerror doubles in, s", lambda row: _later(row.by_error)),
            Column("compared\nover, s", lambda row: digits(row.length)),
        ],
        {"": study.horizons},
        [
            f"Reference: {setting_name(study.reference.setting, study.tick)}. It is itself in doubt by "
            f"{percent(doubt.peak_force)} in peak force, {percent(doubt.impulse)} in impulse, "
            f"{percent(doubt.energy)} in energy and {_millionths(doubt.position_rms)} um in position."
        ],
    )


def _work(study: AccuracyStudy) -> list[Block]:
    """Return the settings that did not fail: cost and error, and the other errors."""
    best = {point.setting for point in front(study.points)}
    recommended = None if study.answer is None else study.answer.setting

    def marks(placed: Placed) -> str:
        of = placed[0].setting
        found = [("recommended", of == recommended), ("the scene's own", of == study.own), ("front", of in best)]
        return ", ".join(word for word, holds in found if holds)

    def is_recommended(placed: Placed) -> bool:
        return placed[0].setting == recommended

    notes = [
        f"Costs, in processor time, on {study.machine}. Impacts: error in peak contact force. "
        "k x: factor on every stiffness. Front: nothing else tried is both as cheap and as exact."
    ]
    resting = [_rested(study)] if study.rest is not None else []
    if any(point.setting.error is not None for point in study.points):
        notes.append(
            "A method that chooses its own steps has its largest error of a step beside it; dt is its longest."
        )
    if any(point.setting.stiffness != 1.0 for point in study.points):
        notes.append("Other stiffness: at the same restitution, compared with the reference at the scene's own.")
    placed = [(p, p.errors, p.cost) for p in study.points if p.errors and p.cost and place_of(p) is not None]
    rows = {"": sorted(placed, key=lambda placed: (placed[2].median, placed[0].setting.key))}
    setting = [
        Column[Placed]("integrator", lambda row: _integrator(row[0].setting), left=True),
        Column("dt\nus", lambda row: _millionths(row[0].dt)),
        Column("per\ntick", lambda row: str(row[0].setting.per_tick)),
        Column("k\nx", lambda row: digits(row[0].setting.stiffness)),
    ]
    work = [
        Column[Placed]("cost\nms/s", lambda row: digits(1e3 * row[2].median)),
        Column("x real\ntime", lambda row: digits(1.0 / row[2].median)),
        Column("impacts\n%", lambda row: hundredths(row[1].peak_force)),
        Column("resting\nload, %", lambda row: hundredths(row[0].resting)),
        Column("", marks, left=True),
    ]
    foretold = [
        Column[Placed]("impacts, %\npredicted", lambda row: hundredths(row[0].predicted)),
        Column("impacts, %\nmeasured", lambda row: hundredths(row[1].peak_force)),
        Column("resting, %\npredicted", lambda row: hundredths(row[0].predicted_resting)),
        Column("resting, %\nmeasured", lambda row: hundredths(row[0].resting)),
        Column("dt, x bound\nof stability", lambda row: digits(row[0].beyond)),
    ]
    other = [
        Column[Placed]("position\nRMS, um", lambda row: _millionths(row[1].position_rms)),
        Column("position\nmax, um", lambda row: _millionths(row[1].position_max)),
        Column("impulse\n%", lambda row: hundredths(row[1].impulse)),
        Column("energy\n%", lambda row: hundredths(row[1].energy)),
    ]
    return [
        Block.of("Work and precision, the cheapest first", [*setting, *work], rows, notes, is_recommended),
        Block.of(
            "Impacts and resting load: predicted by the bounds that choose presets, and measured",
            [setting[0], setting[1], *foretold],
            {"": [row for row in rows[""] if row[0].setting.stiffness == 1.0]},
            resting,
            is_recommended,
        ),
        Block.of("The same settings: other errors", [*setting, *other], rows, strong=is_recommended),
    ]


def _rested(study: AccuracyStudy) -> str:
    """Return a sentence about the reference of errors in resting load."""
    rest = study.rest
    if rest is None or rest.setting is None or rest.contacts == 0:
        return f"Resting load: {'not looked at' if rest is None else rest.reason}."
    return (
        f"Resting load: time means over {digits(rest.window)} s of the normal forces in contacts that stay closed, "
        f"from one settled state; the scene {rest.reason}. Reference: {setting_name(rest.setting, study.tick)}; at "
        f"twice the step it is another by {percent(rest.doubt)}."
    )


def _failures(points: Sequence[Point]) -> Block:
    failed = [point for point in points if place_of(point) is None]
    return Block.of(
        "Settings that failed",
        [
            Column[Point]("integrator", lambda row: _integrator(row.setting), left=True),
            Column("dt\nus", lambda row: _millionths(row.dt)),
            Column("k\nx", lambda row: digits(row.setting.stiffness)),
            Column("why", lambda row: row.failure or "its cost or error could not be measured", left=True),
        ],
        {"": sorted(failed, key=lambda point: (point.setting.integrator, -point.dt, point.setting.key))},
    )


def _ensembles(study: AccuracyStudy) -> Block:
    notes = []
    if study.ensemble_reference is not None:
        notes = [
            f"Compared with {setting_name(study.ensemble_reference, study.tick)}, over seeds that jitter the infeeds. "
            "Equivalent: the confidence interval of the difference lies within the tolerance of "
            f"{_all(percent(row.tolerance) for row in study.comparisons)}; different: outside; undecided: neither. "
            "It resolves: the smallest tolerance that these runs would accept."
        ]
    return Block.of(
        "Long runs: what a line engineer sees",
        [
            Column[Comparison]("setting", lambda row: setting_name(row.setting, study.tick), left=True),
            Column("mean", lambda row: spread(row.mean, row.error)),
            Column("difference\n%", _interval),
            Column("verdict", lambda row: row.verdict, left=True),
            Column("resolves\n%", lambda row: hundredths(row.resolution)),
            Column("runs", lambda row: str(row.runs)),
        ],
        _grouped(
            study.comparisons,
            lambda row: f"{with_unit(row.observable)}: reference {spread(row.reference, row.reference_error)}",
        ),
        notes,
    )


def _lost_runs(study: AccuracyStudy) -> Block:
    return Block.of(
        "Long runs that ended early",
        [
            Column[Sample]("setting", lambda row: setting_name(row.setting, study.tick), left=True),
            Column("seed", lambda row: str(row.seed)),
            Column("why", lambda row: row.failure, left=True),
        ],
        {"": [sample for sample in study.samples if sample.failure]},
    )


def _flow(flow: FlowAnswer | None) -> Block:
    """Return the settings of impulses, the cheapest first, with what they are judged by."""
    return Block.of(
        "Impulses: judged by counts, throughput and positions",
        [
            Column[FlowRow]("steps x\nsweeps", lambda row: f"{row.setting.per_tick} x {row.setting.sweeps}"),
            Column("x real\ntime", lambda row: digits(1.0 / row.cost if row.cost else None)),
            Column("overlap, % of\ndiameter", lambda row: hundredths(row.overlap)),
            Column("stop\nforce, %", lambda row: hundredths(row.stop_force)),
            Column("throughput\n%", lambda row: "-" if row.throughput is None else _interval(row.throughput)),
            Column("single\nforces, %", lambda row: hundredths(row.single_forces) + ("" if row.measured else " ?")),
            Column("verdict", lambda row: row.verdict, left=True),
        ],
        {"": [] if flow is None else flow.rows},
        []
        if flow is None
        else [
            flow.sentence,
            flow.refusal,
            "Stop force and throughput: difference from the reference in long runs. Single forces: error in contacts "
            "that stay closed; ? is predicted, not measured.",
        ],
        lambda row: flow is not None and row.setting == flow.setting,
    )


def _stiffness(rows: Sequence[StiffnessRow]) -> Block:
    """Return one row per quantity and one column per factor: there are more quantities than factors."""
    quantities: list[Quantity] = [
        ("time step, us", lambda row: _millionths(row.dt)),
        ("cost, of factor 1", lambda row: digits(row.cost_ratio)),
        ("overlap, % of diameter", lambda row: hundredths(row.overlap) + (" !" if row.deep else "")),
        ("error in peak force, %", lambda row: hundredths(_peak(row.point))),
    ]
    base = next((row for row in rows if row.factor == 1.0), None)
    for name in dict.fromkeys(name for row in rows for name in row.observables):
        quantities += [(with_unit(name), partial(_mean, name=name)), ("  standard error", partial(_error, name=name))]
        if base is not None:
            quantities.append(("  change, %", partial(_change, base=base, name=name)))
    return Block.of(
        "Softer contacts at the same restitution: what changes",
        [Column[Quantity]("stiffness x", lambda quantity: quantity[0], left=True), *map(_factor, rows)],
        {"": quantities if rows else []},
        [f"! Overlap above {percent(DEEP)} of the diameter: the flow may not be that of stiff bottles."]
        if any(row.deep for row in rows)
        else [],
    )


def _factor(row: StiffnessRow) -> Column[Quantity]:
    return Column(digits(row.factor), lambda quantity: quantity[1](row))


def _answer(study: AccuracyStudy) -> Block:
    answer = study.answer
    moving = [study.moving] if study.moving else []
    if answer is None:
        sentence = (
            f"No setting that was tried keeps {percent(study.tolerance)} in impacts and in resting load within every "
            "bound of stability."
        )
        return Block.of("Answer", (), {}, [*three_lines(study), sentence, *moving])
    if not study.comparisons:
        verdict = []
    elif answer.accepted:
        verdict = ["Long runs accept it: equivalent to the reference in all that was observed."]
    else:
        verdict = ["Long runs have not accepted it."]
    chosen = [foretelling(point) for point in study.points if point.setting == answer.setting]
    notes = [*three_lines(study), answer.sentence, *filter(None, chosen), *moving, *verdict, *answer.doubts]
    return Block.of("Answer", (), {}, notes)


def _integrator(setting: Setting) -> str:
    sweeps = "" if setting.sweeps is None else f" x {setting.sweeps}"
    return setting.integrator + sweeps + ("" if setting.error is None else f" {digits(setting.error)} m/s")


def _grouped(rows: Iterable[Row], caption: Callable[[Row], str]) -> dict[str, list[Row]]:
    """Rows by caption, in the order in which captions first come."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(caption(row), []).append(row)
    return groups


def _mean(row: StiffnessRow, name: str) -> str:
    return digits(row.observables[name][0]) if name in row.observables else "-"


def _error(row: StiffnessRow, name: str) -> str:
    return digits(row.observables[name][1]) if name in row.observables else "-"


def _change(row: StiffnessRow, base: StiffnessRow, name: str) -> str:
    values = [of.observables.get(name, (math.nan, math.nan))[0] for of in (row, base)]
    if row is base or values[1] == 0.0 or math.isnan(values[0]):
        return ""
    change = 100.0 * (values[0] / values[1] - 1.0)
    return f"{'+' if change > 0.0 else ''}{digits(change)}"


def _peak(point: Point | None) -> float | None:
    return None if point is None or point.errors is None else point.errors.peak_force


def _interval(row: Comparison) -> str:
    """`-0.37 .. +0.04` %: two digits of the interval's length."""
    length = 100.0 * (row.high - row.low)
    if not (math.isfinite(length) and length > 0.0):
        return "-"
    decimals = max(0, 1 - math.floor(math.log10(length)))
    low, high = (round(100.0 * end, decimals) + 0.0 for end in (row.low, row.high))  # + 0.0: no minus before a zero
    return f"{low:+.{decimals}f} .. {high:+.{decimals}f}"


def _millionths(value: float | None) -> str:
    """Return millionths as text: um of m, us of s."""
    return digits(None if value is None else 1e6 * value)


def _later(seconds: float) -> str:
    return digits(seconds) if math.isfinite(seconds) else "not seen"


def _range(texts: Iterable[str]) -> str:
    first, *rest = texts
    return f"{first} .. {rest[-1]}" if rest else first


def _all(values: Iterable[object]) -> str:
    """Return the common value of all rows, or all values: `64`, `64 or 128`."""
    return " or ".join(map(str, dict.fromkeys(values)))
