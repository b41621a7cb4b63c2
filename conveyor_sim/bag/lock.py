"""Lock on the file of a recording. Its writer holds the lock, which keeps other processes from repairing the file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from conveyor_sim.errors import BagError
from conveyor_sim.support.file_lock import locked


@contextmanager
def alone(path: Path) -> Iterator[None]:
    """Hold the lock of a file. Raise BagError if another process is recording or repairing it."""
    with ExitStack() as stack:
        try:
            stack.enter_context(locked(path))
        except BlockingIOError as error:
            raise BagError(
                f"{path}: is being recorded or repaired by another process, expected a recording that has ended"
            ) from error
        yield
