# SPDX-License-Identifier: Apache-2.0
"""Tables of a bag written to Parquet and CSV files, block by block."""

from __future__ import annotations

import csv
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from conveyor_sim.bag.tables import Block, TableColumn, TopicReader, blocks, table_columns
from conveyor_sim.errors import BagError, ConveyorError

if TYPE_CHECKING:
    import pyarrow

Progress = Callable[[], object]


def write_parquet(bag: TopicReader, topic: str, file: Path, progress: Progress | None = None) -> int:
    """Write the table of a topic to a Parquet file, and return its number of rows.

    Names of bottle types, belts and rails are dictionaries; the metadata of each field state its unit. progress: see
    `blocks`. Raise BagError as `blocks`, ConveyorError if the file can't be written or pyarrow is missing.
    """
    require_pyarrow()
    from pyarrow import parquet

    columns = table_columns(bag, topic)
    schema = _schema(columns)
    rows = 0
    with _finished(file) as unfinished, parquet.ParquetWriter(unfinished, schema) as writer:
        for block in blocks(bag, topic, progress):
            writer.write_table(_arrow_table(columns, schema, block))
            rows += len(block["tick"])
    return rows


def write_csv(bag: TopicReader, topic: str, file: Path, progress: Progress | None = None) -> int:
    """Write the table of a topic to a CSV file with a header, and return its number of rows.

    Absent values and NaN are empty. progress: see `blocks`. Raise BagError as `blocks`, ConveyorError if the file can't
    be written.
    """
    columns = table_columns(bag, topic)
    rows = 0
    with _finished(file) as unfinished, unfinished.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([column.name for column in columns])
        for block in blocks(bag, topic, progress):
            writer.writerows(zip(*(_texts(column, block[column.name]) for column in columns), strict=True))
            rows += len(block["tick"])
    return rows


def require_pyarrow() -> None:
    """Raise ConveyorError if pyarrow is missing."""
    if find_spec("pyarrow") is None:
        raise ConveyorError("--parquet: pyarrow is not installed, expected it (pip install 'conveyor_sim[tables]')")


@contextmanager
def _finished(file: Path) -> Iterator[Path]:
    """Yield a path to write to, which becomes `file` at the end; after an error, `file` is as before."""
    unfinished = file.with_name(f".{file.name}.{os.getpid()}")
    try:
        yield unfinished
        os.replace(unfinished, file)
    except BagError:
        raise
    except OSError as error:
        raise ConveyorError(f"{file}: can't be written ({error.strerror or error})") from error
    finally:
        with suppress(OSError):
            unfinished.unlink()


def _schema(columns: Sequence[TableColumn]) -> pyarrow.Schema:
    import pyarrow

    def kind(column: TableColumn) -> Any:
        if column.labels:
            return pyarrow.dictionary(pyarrow.int32(), pyarrow.string())
        return pyarrow.string() if column.dtype is object else pyarrow.from_numpy_dtype(column.dtype)

    return pyarrow.schema(
        [
            pyarrow.field(column.name, kind(column), metadata={"unit": column.unit} if column.unit else None)
            for column in columns
        ]
    )


def _arrow_table(columns: Sequence[TableColumn], schema: pyarrow.Schema, block: Block) -> pyarrow.Table:
    import pyarrow

    arrays = []
    for column in columns:
        values = block[column.name]
        if column.labels:
            codes = pyarrow.array(values, mask=values < 0)
            arrays.append(pyarrow.DictionaryArray.from_arrays(codes, list(column.labels)))
        elif column.absent is not None:
            arrays.append(pyarrow.array(values, mask=values == column.absent))
        else:
            arrays.append(pyarrow.array(values, type=schema.field(column.name).type))
    return pyarrow.table(arrays, schema=schema)


def _texts(column: TableColumn, values: Any) -> list[Any]:
    if column.labels:
        return ["" if code < 0 else column.labels[code] for code in values.tolist()]
    if column.absent is not None:
        return ["" if value == column.absent else value for value in values.tolist()]
    if column.dtype is np.float64:
        return ["" if value != value else value for value in values.tolist()]
    listed: list[Any] = values.tolist()
    return listed
