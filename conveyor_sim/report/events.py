# SPDX-License-Identifier: Apache-2.0
"""Events of a recording (topic `events`), selected by kind, name and time, as a listing or as CSV."""

from __future__ import annotations

import csv
import io
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import NamedTuple, get_args

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.reader import mcap_files, open_bag
from conveyor_sim.columns.events import Kind
from conveyor_sim.errors import BagError, ConveyorError
from conveyor_sim.report.listing import ListingRow, listing, matches
from conveyor_sim.support.files import FileError, write_file
from conveyor_sim.support.printable import SENTENCE, printable

KINDS: tuple[str, ...] = get_args(Kind)

OFTEN = 3
"""Number of equal events from which they are folded."""


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
        row for row in _all(path) if first <= row.time <= last and matches(row.kind, kinds) and matches(row.name, names)
    ]


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


def event_listing(rows: Sequence[EventRow], width: int | None, every: bool = False) -> list[str]:
    """Return the lines for a terminal. width: see `report.listing.listing`. every: print repeated events one by one."""
    if not rows:
        return ["no such event"]
    folds = [Fold(row) for row in rows] if every else folded(rows)
    records = [ListingRow((f"{fold.first.time:.3f}", fold.first.kind, fold.first.name), fold.text) for fold in folds]
    return listing(("time, s", "kind", "name", "text"), records, width, right=[0])


@dataclass
class Fold:
    """Equal events in one line: the first one, their number, and the time of the last one."""

    first: EventRow
    count: int = 1
    last: float = 0.0
    """s, time of the last one."""

    @property
    def text(self) -> str:
        """Text of the event, and its number of occurrences."""
        row = self.first
        if row.kind.startswith("bottle_"):
            return f"bottle {row.bottle}" if self.count == 1 else f"{self.count} bottles until {self.last:.3f} s"
        implied = row.kind.startswith("alarm_") or (row.kind == "machine_state" and row.text)
        value = "" if row.value is None or implied else f"{row.value:g}"
        text = ": ".join(filter(None, (value, row.text)))
        return text if self.count == 1 else f"{text} ({self.count} times until {self.last:.3f} s)".lstrip()


def folded(rows: Sequence[EventRow]) -> list[Fold]:
    """Return the events in order with repeated ones folded.

    Events that happen at least OFTEN times are repeated. All of them between two other events are one line each, so
    that a machine that starves in each cycle hides nothing.
    """
    counts = Counter(map(_sort_of, rows))
    folds: list[Fold] = []
    open_folds: dict[tuple[object, ...], Fold] = {}
    for row in rows:
        sort = _sort_of(row)
        if counts[sort] < OFTEN:
            folds.append(Fold(row))
            open_folds = {}
        elif (fold := open_folds.get(sort)) is not None:
            fold.count, fold.last = fold.count + 1, row.time
        else:
            folds.append(Fold(row))
            open_folds[sort] = folds[-1]
    return folds


def _sort_of(row: EventRow) -> tuple[object, ...]:
    """Return the properties that equal events share. Those of bottles share no ID and no count."""
    return (row.kind, row.name) if row.kind.startswith("bottle_") else (row.kind, row.name, row.value, row.text)


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
