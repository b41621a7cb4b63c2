"""Events of a recording (topic `events`), selected by kind, name and time, as a table or as CSV."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import NamedTuple, get_args

from rich.box import SIMPLE
from rich.console import RenderableType
from rich.table import Table

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.reader import mcap_files, open_bag
from conveyor_sim.columns.events import Kind
from conveyor_sim.errors import BagError, ConveyorError
from conveyor_sim.support.files import FileError, write_file
from conveyor_sim.support.printable import SENTENCE, printable

KINDS: tuple[str, ...] = get_args(Kind)


class EventRow(NamedTuple):
    """One event."""

    time: float
    """s, simulated, at which it took effect."""
    tick: int
    kind: str
    name: str
    bottle: int | None
    """Id."""
    value: float | None
    text: str


def chosen_events(
    path: Path,
    kinds: Sequence[str] = (),
    names: Sequence[str] = (),
    start: float | None = None,
    stop: float | None = None,
) -> list[EventRow]:
    """Return the selected events of a bag in order.

    kinds, names: patterns (`alarm_*`, `machines/*`), one of which must match; empty: all. start, stop: first and last
    time, s. Raise ConveyorError for a pattern that matches no kind or for a stop before the start, BagError for a bag
    without the topic.
    """
    for kind in kinds:
        if not any(fnmatchcase(known, kind) for known in KINDS):
            expected = f"one of {', '.join(KINDS)}, or a pattern with *"
            raise ConveyorError(f"--kind: {printable(kind)} given, expected {expected}")
    first, last = -math.inf if start is None else start, math.inf if stop is None else stop
    if not first <= last:
        raise ConveyorError(f"--from and --to: {first:g} and {last:g} given, expected two times in s, in this order")
    return [
        row for row in _all(path) if first <= row.time <= last and _fits(row.kind, kinds) and _fits(row.name, names)
    ]


def _fits(text: str, patterns: Sequence[str]) -> bool:
    return not patterns or any(fnmatchcase(text, pattern) for pattern in patterns)


def _all(path: Path) -> Iterator[EventRow]:
    with open_bag(path) as bag, bag.sense():
        expected, found = TOPICS["events"].type, bag.types.get("events")
        if found is None:
            raise BagError(
                f"{path}: holds no topic events, expected a recording with it: "
                "this one was made by an earlier version, or with chosen topics"
            )
        if found != expected:
            raise BagError(f"{path}: its topic events is of type {printable(found)}, expected {expected}")
        for frame in bag.read("events"):
            data = frame.data
            columns = (data.at, data.kind, data.name, data.bottle, data.value, data.text)
            for at, kind, name, bottle, value, text in zip(*columns, strict=True):
                yield EventRow(
                    round(bag.time(int(at)), 9),
                    int(at),
                    printable(kind),
                    printable(name),
                    None if bottle < 0 else int(bottle),
                    None if math.isnan(value) else float(value),
                    printable(text, SENTENCE),
                )


def event_table(rows: Sequence[EventRow]) -> RenderableType:
    """For a terminal."""
    if not rows:
        return "no such event"
    table = Table(box=SIMPLE, pad_edge=False)
    table.add_column("time, s", justify="right", no_wrap=True)
    table.add_column("tick", justify="right", no_wrap=True)
    for head in ("kind", "name"):
        table.add_column(head, overflow="fold")
    for head in ("bottle", "value"):
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("text", overflow="fold")
    for row in rows:
        bottle, value = ("" if number is None else f"{number:g}" for number in (row.bottle, row.value))
        table.add_row(f"{row.time:.3f}", str(row.tick), row.kind, row.name, bottle, value, row.text)
    return table


def write_csv(rows: Sequence[EventRow], file: Path, bag: Path) -> None:
    """Write one line per event below a header; a failure leaves the previous content of the file.

    Raise ConveyorError if the file can't be written, or if it is part of the bag.
    """
    parts = [part for part in (*mcap_files(bag), bag / "metadata.yaml") if part.exists()]
    if file.exists() and any(map(file.samefile, parts)):
        raise ConveyorError(f"--csv: {file} given, which is a file of the recording, expected another one")
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(EventRow._fields)
    writer.writerows(rows)
    try:
        write_file(file, text.getvalue().encode())
    except FileError as error:
        raise ConveyorError(f"--csv: {file}: {error}") from error
