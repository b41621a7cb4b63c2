# SPDX-License-Identifier: Apache-2.0
"""Claims: if several processes need a kernel at the same time, one compiles it and the others wait.

Each kernel has a byte of one file, which a process locks while it compiles. The system releases the lock when a process
ends for any reason.
"""

import fcntl
import hashlib
import os
import time
import weakref
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

NAME = "claims"
"""Name of the file, in the folder of the kernels."""

LONGEST = 60.0
"""Longest wait for another process, which may be stopped, s. A kernel takes some seconds of a core."""

PAUSE = 0.02
"""Interval of polling, s."""


class Claims:
    """Claims of a folder. If files can't be locked, every process compiles for itself."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / NAME
        self._file: int | None = None

    def take(self, name: str, look: Callable[[], object]) -> bool:
        """Claim a kernel by the name of its file. Return True if another process held it until now or for too long.

        look: called repeatedly during the wait. Raises only its exceptions.
        """
        end = time.monotonic() + LONGEST
        waited = False
        while not self._lock(name) and time.monotonic() < end:
            look()
            time.sleep(PAUSE)
            waited = True
        return waited

    def release(self, name: str) -> None:
        """Release a claim. Raises nothing."""
        if self._file is not None:
            with suppress(OSError):
                fcntl.lockf(self._file, fcntl.LOCK_UN, 1, _place(name))

    def _lock(self, name: str) -> bool:
        """Lock a kernel's byte. Return False if another process has it."""
        try:
            if self._file is None:
                self._file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
                weakref.finalize(self, os.close, self._file)
            fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, _place(name))
        except BlockingIOError:
            return False
        except OSError:
            return True
        return True


def _place(name: str) -> int:
    """Return the byte of a kernel. Two kernels with the same byte wait for each other."""
    return int.from_bytes(hashlib.blake2b(name.encode(), digest_size=6).digest(), "big")
