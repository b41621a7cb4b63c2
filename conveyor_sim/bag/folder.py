# SPDX-License-Identifier: Apache-2.0
"""The folder of a recording, which is checked before the simulation is compiled and run; locks on its files."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from conveyor_sim.errors import BagError
from conveyor_sim.support.file_lock import locked


@contextmanager
def alone(path: Path) -> Iterator[None]:
    """Hold the lock of a file, as its writer does. Raise BagError if another process is recording or repairing it."""
    with ExitStack() as stack:
        try:
            stack.enter_context(locked(path))
        except BlockingIOError as error:
            raise BagError(
                f"{path}: is being recorded or repaired by another process, expected a recording that has ended"
            ) from error
        yield


def require_recordable(path: Path) -> None:
    """Raise BagError unless a folder is empty or can be made, and can be written to. No file or folder is left."""
    made = make_folder(path)
    try:
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        raise _refused(path, error) from error
    finally:
        remove_folders(made)


def make_folder(path: Path) -> list[Path]:
    """Make a folder for a recording. Return the folders that did not exist before, the innermost first.

    Raises BagError if it can't be made, or is not empty.
    """
    made: list[Path] = []
    try:
        made += [folder for folder in (path, *path.parents) if not folder.exists()]
        path.mkdir(parents=True, exist_ok=True)
        occupied = sorted(file.name for file in path.iterdir())
    except OSError as error:
        remove_folders(made)
        raise _refused(path, error) from error
    if occupied:
        bag = next((name for name in occupied if ".mcap" in name), None)
        holds = f" (it holds a recording, {bag})" if bag else ""
        raise BagError(f"{path}: is not empty{holds}, expected a new or an empty folder to record into")
    return made


def bag_folder(record: Path | None, runs: int) -> Path | None:
    """Return the folder of a run that follows `runs` others: `<record>`, then `<record>_1`, `<record>_2`, ..."""
    if record is None or runs == 0:
        return record
    return record.with_name(f"{record.name}_{runs}")


def remove_folders(folders: Iterable[Path]) -> None:
    """Remove the empty ones of these folders, in this order."""
    for folder in folders:
        with suppress(OSError):
            folder.rmdir()


def _refused(path: Path, error: OSError) -> BagError:
    # With exist_ok, mkdir raises FileExistsError only for a path that is not a folder.
    why = "a file is in its place" if isinstance(error, FileExistsError) else error.strerror
    return BagError(f"{path}: can't be created as the folder of a recording ({why})")
