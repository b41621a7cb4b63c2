"""Who compiles what: of processes that want a kernel at the same time, one compiles it and the others wait for it.

Each kernel has a byte of one file, which a process locks while it compiles. The system gives the lock back when a
process ends, however it ends.
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
"""Of the file, in the folder of the kernels."""

LONGEST = 60.0
"""s that another process is waited for: it may stand still. A kernel takes some seconds of a core."""

PAUSE = 0.02
"""s between two looks."""


class Claims:
    """Those of a folder. Where files can't be locked, every process compiles for itself."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / NAME
        self._file: int | None = None

    def take(self, name: str, look: Callable[[], object]) -> bool:
        """Claim a kernel by the name of its file. Returns whether another process had it, and gave it back since then
        or was waited for too long.

        look: called again and again while the other one is waited for. Raises only what that raises.
        """
        end = time.monotonic() + LONGEST
        waited = False
        while not self._lock(name) and time.monotonic() < end:
            look()
            time.sleep(PAUSE)
            waited = True
        return waited

    def give_back(self, name: str) -> None:
        """Others may look for the kernel now. Raises nothing."""
        if self._file is not None:
            with suppress(OSError):
                fcntl.lockf(self._file, fcntl.LOCK_UN, 1, _place(name))

    def _lock(self, name: str) -> bool:
        """Whether no other process has it."""
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
    """Which byte: two kernels with the same one only wait for each other."""
    return int.from_bytes(hashlib.blake2b(name.encode(), digest_size=6).digest(), "big")
