"""A lock on the file of a recording: whoever writes it holds it, so that nobody repairs it meanwhile."""

from __future__ import annotations

import contextlib
import fcntl
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from conveyor_sim.errors import BagError


def claim(stream: IO[bytes]) -> None:
    """Locks an open file until it is closed or its process ends. Raises BlockingIOError if another has locked it."""
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:
        pass  # a file system without locks


@contextlib.contextmanager
def alone(path: Path) -> Iterator[None]:
    """Holds the lock of a file. Raises BagError if another process is recording or repairing it."""
    with path.open("rb") as stream:
        try:
            claim(stream)
        except BlockingIOError as error:
            raise BagError(
                f"{path}: is being recorded or repaired by another process, expected a recording that has ended"
            ) from error
        yield
