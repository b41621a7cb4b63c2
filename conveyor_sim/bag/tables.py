# SPDX-License-Identifier: Apache-2.0
"""Topics of a bag as tables: one row per bottle, contact, event or tick, in blocks of columns; pandas data frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import DTypeLike, NDArray

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.errors import BagError
from conveyor_sim.support.printable import SENTENCE, printable

if TYPE_CHECKING:
    import pandas

ROWS = 100_000
"""Rows of a block, at least; the last block may be shorter."""

Block = Mapping[str, NDArray[Any]]
"""Columns by name, each (n,). Texts are arrays of objects."""


class TopicReader(Protocol):
    """The part of `reader.Bag` that tables need."""

    path: Path
    line: Any

    @property
    def types(self) -> dict[str, str]:
        """Message type by topic."""

    def read(self, topic: str) -> Iterator[Any]:
        """Yield the messages of one topic, as frames."""

    def sense(self) -> AbstractContextManager[None]:
        """Return a context for code that interprets messages."""


@dataclass(frozen=True)
class TableColumn:
    """One column of a table."""

    name: str
    dtype: DTypeLike
    """Type of the values; object for texts."""
    unit: str = ""
    """SI unit; empty without one."""
    labels: Sequence[str] = ()
    """Names that the values are indices of; -1: none. Empty: the values are no indices."""
    absent: int | None = None
    """Value that stands for an absent one."""


BOTTLES = (
    TableColumn("id", np.uint64),
    TableColumn("type", np.int32, labels=("bottle_types",)),
    TableColumn("x", np.float64, "m"),
    TableColumn("y", np.float64, "m"),
    TableColumn("theta", np.float64, "rad"),
    TableColumn("vx", np.float64, "m/s"),
    TableColumn("vy", np.float64, "m/s"),
    TableColumn("omega", np.float64, "rad/s"),
    TableColumn("belt", np.int32, labels=("belts",)),
    TableColumn("peak_force", np.float64, "N"),
    TableColumn("impulse", np.float64, "N s"),
)
"""Columns of bottles; labels name the field of Line that holds them, here and below."""

CONTACTS = (
    TableColumn("kind", np.int32, labels=("bottle", "rail")),
    TableColumn("a", np.uint64),
    TableColumn("b", np.uint64),
    TableColumn("rail", np.int32, labels=("rails",)),
    TableColumn("x", np.float64, "m"),
    TableColumn("y", np.float64, "m"),
    TableColumn("nx", np.float64),
    TableColumn("ny", np.float64),
    TableColumn("overlap", np.float64, "m"),
    TableColumn("normal_force", np.float64, "N"),
    TableColumn("tangential_force", np.float64, "N"),
)

EVENTS = (
    TableColumn("kind", object),
    TableColumn("name", object),
    TableColumn("bottle", np.int64, absent=-1),
    TableColumn("value", np.float64),
    TableColumn("text", object),
)

BELTS = (
    TableColumn("belt", np.int32, labels=("belts",)),
    TableColumn("commanded", np.float64, "m/s"),
    TableColumn("actual", np.float64, "m/s"),
)

TIME = (TableColumn("time", np.float64, "s"), TableColumn("tick", np.int64))
"""First columns of every table."""

TABLES = ("bottles", "contacts", "signals", "events", "belts")
"""Topics that have a table."""


def table_columns(bag: TopicReader, topic: str) -> list[TableColumn]:
    """Return the columns of the table of a topic, time and tick first. Raise BagError for a topic without table."""
    if topic not in TABLES:
        raise BagError(f"{bag.path}: no table of topic {printable(topic)}, expected one of {', '.join(TABLES)}")
    recorded = bag.types.get(topic)
    if recorded is None:
        raise BagError(f"{bag.path}: holds no topic {topic}, expected a recording with it")
    if recorded != TOPICS[topic].type:
        raise BagError(f"{bag.path}: its topic {topic} is of type {printable(recorded)}, expected {TOPICS[topic].type}")
    if topic == "signals":
        units = {tag.name: "" if tag.unit == "1" else printable(tag.unit) for tag in bag.line.tags}
        recorded_names = bag.line.signal_names
        names = _unique([printable(name) for name in recorded_names])
        own = tuple(
            TableColumn(name, np.float64, units.get(signal, ""))
            for name, signal in zip(names, recorded_names, strict=True)
        )
    else:
        own = {"bottles": BOTTLES, "contacts": CONTACTS, "events": EVENTS, "belts": BELTS}[topic]
    return [*TIME, *(_with_labels(column, bag.line) for column in own)]


def blocks(bag: TopicReader, topic: str, progress: Callable[[], object] | None = None) -> Iterator[Block]:
    """Yield the rows of the table of a topic in blocks, in time order. A table without rows has one empty block.

    progress: called after each message. Raise BagError as `table_columns`.
    """
    columns = table_columns(bag, topic)
    parts: list[Block] = []
    rows, yielded = 0, False
    with bag.sense():
        for frame in bag.read(topic):
            part = _ROWS[topic](bag, frame, columns)
            parts.append(part)
            rows += len(part["tick"])
            if rows >= ROWS:
                yield _joined(columns, parts)
                parts, rows, yielded = [], 0, True
            if progress is not None:
                progress()
    if parts or not yielded:
        yield _joined(columns, parts)


def frame_of(bag: TopicReader, topic: str) -> pandas.DataFrame:
    """Return the table of a topic as a pandas DataFrame; see `Bag.frame`."""
    if find_spec("pandas") is None:
        raise BagError("frame: pandas is not installed, expected it (pip install 'conveyor_sim[tables]')")
    import pandas

    columns = table_columns(bag, topic)
    table = _joined(columns, list(blocks(bag, topic)))
    data = {}
    for column in columns:
        values = table[column.name]
        if column.labels:
            data[column.name] = pandas.Categorical.from_codes(values, categories=list(column.labels))
        elif column.absent is not None:
            data[column.name] = pandas.arrays.IntegerArray(values, values == column.absent)
        else:
            data[column.name] = values
    frame = pandas.DataFrame(data)
    frame.attrs["units"] = {column.name: column.unit for column in columns if column.unit}
    return frame


def _with_labels(column: TableColumn, line: Any) -> TableColumn:
    if len(column.labels) != 1:
        return column
    names = _unique([printable(name) for name in getattr(line, column.labels[0])])
    # A category needs a name, even on a line without belts or rails.
    return TableColumn(column.name, column.dtype, column.unit, names or ("none",))


def _unique(names: Sequence[str]) -> tuple[str, ...]:
    """Return the names with a number behind each one that occurred before, as in a foreign recording."""
    seen: dict[str, int] = {}
    unique = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        unique.append(name if seen[name] == 1 else f"{name} ({seen[name]})")
    return tuple(unique)


def _joined(columns: Sequence[TableColumn], parts: Sequence[Block]) -> Block:
    if not parts:
        return {column.name: np.zeros(0, dtype=column.dtype) for column in columns}
    return {column.name: np.concatenate([part[column.name] for part in parts]) for column in columns}


def _times(bag: TopicReader, ticks: NDArray[np.int64]) -> NDArray[np.float64]:
    return np.round(ticks * int(bag.line.tick_ns) * 1e-9, 9)


def _fields(bag: TopicReader, frame: Any, columns: Sequence[TableColumn], given: Mapping[str, NDArray[Any]]) -> Block:
    """Return the rows of a message whose entries belong together. given: columns that are no field of it."""
    own = [column for column in columns[len(TIME) :] if column.name not in given]
    values = {column.name: np.asarray(getattr(frame.data, column.name)).astype(column.dtype) for column in own}
    count = len(next(iter(values.values())))
    for column in columns:
        codes = given.get(column.name, values.get(column.name))
        if (
            column.labels
            and codes is not None
            and codes.size
            and not (codes.min() >= -1 and codes.max() < len(column.labels))
        ):
            raise BagError(f"{bag.path}: {column.name} {codes.max()} at tick {frame.tick}, expected an index of a name")
    ticks = np.full(count, frame.tick, dtype=np.int64)
    return {"time": _times(bag, ticks), "tick": ticks, **values, **given}


def _bottle_rows(bag: TopicReader, frame: Any, columns: Sequence[TableColumn]) -> Block:
    return _fields(bag, frame, columns, {})


def _contact_rows(bag: TopicReader, frame: Any, columns: Sequence[TableColumn]) -> Block:
    kind = np.asarray(frame.data.kind).astype(np.int32)
    rail = np.where(kind == 1, np.asarray(frame.data.b).astype(np.int64), -1).astype(np.int32)
    return _fields(bag, frame, columns, {"rail": rail})


def _belt_rows(bag: TopicReader, frame: Any, columns: Sequence[TableColumn]) -> Block:
    return _fields(bag, frame, columns, {"belt": np.arange(len(frame.data.actual), dtype=np.int32)})


def _event_rows(bag: TopicReader, frame: Any, columns: Sequence[TableColumn]) -> Block:
    data = frame.data
    ticks = np.asarray(data.at).astype(np.int64)
    texts = {
        name: np.array([printable(text, SENTENCE) for text in getattr(data, name)], dtype=object)
        for name in ("kind", "name", "text")
    }
    numbers = {"bottle": np.asarray(data.bottle, dtype=np.int64), "value": np.asarray(data.value, dtype=np.float64)}
    return {"time": _times(bag, ticks), "tick": ticks, **texts, **numbers}


def _signal_rows(bag: TopicReader, frame: Any, columns: Sequence[TableColumn]) -> Block:
    """Return the row of a process image: the values that a controller reads, forced ones included."""
    values = np.asarray(frame.data, dtype=np.float64)
    names = [column.name for column in columns[len(TIME) :]]
    if len(values) != len(names):
        raise BagError(f"{bag.path}: {len(values)} signals at tick {frame.tick}, expected {len(names)}")
    ticks = np.array([frame.tick], dtype=np.int64)
    return {"time": _times(bag, ticks), "tick": ticks, **dict(zip(names, values[:, None], strict=True))}


_ROWS: Mapping[str, Callable[[TopicReader, Any, Sequence[TableColumn]], Block]] = {
    "bottles": _bottle_rows,
    "contacts": _contact_rows,
    "signals": _signal_rows,
    "events": _event_rows,
    "belts": _belt_rows,
}
