# SPDX-License-Identifier: Apache-2.0
"""Locks between processes: flock(2) on an open file or folder. It ends with the process that holds it."""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

_INTERVAL = 0.02
"""Wall time between two attempts, s."""


def lock(stream: IO[bytes] | IO[str] | int) -> None:
    """Lock an open file until it is closed. Raises BlockingIOError if another process has locked it.

    A file system without locks counts as free.
    """
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:
        pass


@contextmanager
def locked(path: Path, patience: float = 0.0) -> Iterator[None]:
    """Hold the lock of a file or folder. Wait up to `patience` (s of wall time) for another process.

    Raises BlockingIOError if that still holds it, OSError if the path can't be opened.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        end = time.monotonic() + patience
        while time.monotonic() < end:
            with suppress(BlockingIOError):
                lock(descriptor)
                break
            time.sleep(_INTERVAL)
        else:
            lock(descriptor)
        yield
    finally:
        os.close(descriptor)
