"""Lock on the file of a recording. Its writer holds the lock, which keeps other processes from repairing the file."""

from __future__ import annotations

import contextlib
import fcntl
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from conveyor_sim.errors import BagError


def claim(stream: IO[bytes]) -> None:
    """Lock an open file until it is closed or its process ends. Raise BlockingIOError if another process holds it."""
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:
        pass  # a file system without locks


@contextlib.contextmanager
def alone(path: Path) -> Iterator[None]:
    """Hold the lock of a file. Raise BagError if another process is recording or repairing it."""
    with path.open("rb") as stream:
        try:
            claim(stream)
        except BlockingIOError as error:
            raise BagError(
                f"{path}: is being recorded or repaired by another process, expected a recording that has ended"
            ) from error
        yield
