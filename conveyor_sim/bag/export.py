# SPDX-License-Identifier: Apache-2.0
"""Export of a bag: one file per table and format in a folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.table_files import require_pyarrow, write_csv, write_parquet
from conveyor_sim.bag.tables import table_columns
from conveyor_sim.errors import ConveyorError

DEFAULT = ("bottles", "contacts", "signals", "events")
"""Tables that are exported unless others are chosen, as far as they were recorded."""

WRITERS = {"parquet": write_parquet, "csv": write_csv}


def export_tables(
    path: Path,
    folder: Path,
    formats: Sequence[str],
    tables: Sequence[str] = (),
    progress: Callable[[float, float], object] | None = None,
) -> dict[Path, int]:
    """Write tables of a bag into a folder, and return the number of rows by file.

    formats: "parquet", "csv" or both. tables: topics (`bag.tables.TABLES`); empty: those of DEFAULT that were recorded.
    progress: called with the messages that were written and their total. Raise BagError for a topic without table or
    recording, ConveyorError if a file can't be written.
    """
    if "parquet" in formats:
        require_pyarrow()
    with open_bag(path) as bag:
        chosen = list(dict.fromkeys(tables)) or [name for name in DEFAULT if name in bag.types]
        for topic in chosen:
            table_columns(bag, topic)
        _make(folder)
        messages = sum(bag.counts[topic] for topic in chosen) * len(formats)
        done = 0

        def update() -> None:
            nonlocal done
            done += 1
            if progress is not None:
                progress(done, messages)

        rows: dict[Path, int] = {}
        for topic in chosen:
            for suffix in formats:
                file = folder / f"{topic}.{suffix}"
                rows[file] = WRITERS[suffix](bag, topic, file, update)
        return rows


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConveyorError(f"{folder}: can't be created ({error.strerror}), expected a folder to write to") from error
