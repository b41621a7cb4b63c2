"""Who compiles what: of processes that want a kernel at the same time, one compiles it and the others wait for it.

Each kernel has a byte of one file, which a process locks while it compiles. The system gives the lock back when a
process ends, however it ends.
"""

import fcntl
import hashlib
import os
import time
from collections.abc import Callable
from pathlib import Path

NAME = "claims"
"""Of the file, in the folder of the kernels."""

LONGEST = 60.0
"""s that another process is waited for: it may stand still. A kernel takes up to ten of a core."""

PAUSE = 0.02
"""s between two looks."""


class Claims:
    """Those of a folder. Where files can't be locked, every process compiles for itself."""

    def __init__(self) -> None:
        self._file: int | None = None
        self._path: Path | None = None

    def take(self, folder: Path, name: str, look: Callable[[], object]) -> bool:
        """Claim a kernel. Returns whether another process had it, and has compiled it or given up since.

        look: called again and again while the other one is waited for; what it raises ends that.
        """
        end = time.monotonic() + LONGEST
        waited = False
        while not self._lock(folder, name) and time.monotonic() < end:
            look()
            time.sleep(PAUSE)
            waited = True
        return waited

    def give_back(self, folder: Path, name: str) -> None:
        """Others may look for the kernel now."""
        if self._file is not None and self._path == folder:
            fcntl.lockf(self._file, fcntl.LOCK_UN, 1, _place(name))

    def _lock(self, folder: Path, name: str) -> bool:
        """Whether nobody else has it."""
        try:
            if self._path != folder:
                flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC
                self._file, self._path = os.open(folder / NAME, flags, 0o600), folder
            assert self._file is not None
            fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, _place(name))
        except BlockingIOError:
            return False
        except OSError:
            return True
        return True


def _place(name: str) -> int:
    return int.from_bytes(hashlib.blake2b(name.encode(), digest_size=6).digest(), "big")
