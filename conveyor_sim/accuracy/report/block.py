"""A table of texts and its two renderings: for the terminal, and as Markdown."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderResult
from rich.table import Table
from rich.text import Text

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
    """A title, a table and sentences below it; no table where there are no rows."""

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
