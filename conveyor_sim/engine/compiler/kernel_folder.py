# SPDX-License-Identifier: Apache-2.0
"""Files of compiled kernels: one per kernel and its types, with a checksum.

A file that is damaged, or that another user could have written, is deleted, and the kernel is compiled again.
"""

import hashlib
import logging
import os
import stat
import threading
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from conveyor_sim.engine.compiler.claims import Claims

LOG = logging.getLogger("conveyor_sim")
MAGIC = b"conveyor_sim kernel 1\n"
CHECKSUM = 32
"""Bytes of a checksum (BLAKE2b)."""


class NotCached(Exception):
    """A kernel is not in the cache, and `cached_only` forbids compiling it."""


class KernelFolder:
    """Files by name in a folder. Files that can't be written are sent to another process, if `send` is set."""

    def __init__(self, path: Path | None, remark: str) -> None:
        """Use a folder, or none. remark: logged when the first kernel is read, "" for nothing."""
        self.path = path
        self._remark = remark
        self._full = False
        self._claims = None if path is None else Claims(path)
        self.received: dict[str, bytes] = {}
        """Files by name that a compiling process has sent to this one."""
        self.send: Callable[[str, bytes], object] | None = None
        """Sends a file by name and content to the process for which this one compiles."""
        self.before_read: Callable[[], object] | None = None
        """Called before each kernel is read; an exception from it ends compiling and loading."""

    def use(self, path: Path | None) -> None:
        """Switch to another folder, or to none."""
        self.path, self._remark = path, ""
        self._claims = None if path is None else Claims(path)

    def read(self, name: str) -> bytes | None:
        """Return the content written under a name; None if there is no usable file."""
        self._call_before_read()
        self._log_remark()
        if self.path is None or name in self.received:
            return self.received.get(name)
        path = self.path / name
        try:
            content, fault = _read_own(path)
        except FileNotFoundError:
            return None
        except OSError as error:
            content, fault = b"", f"it can't be read ({error.strerror})"
        if not fault:
            start = len(MAGIC) + CHECKSUM
            if content[:start] == MAGIC + checksum(content[start:]):
                return content[start:]
            fault = "it is damaged"
        self.discard(name, fault)
        return None

    def discard(self, name: str, fault: str) -> None:
        """Delete a file that can't be used."""
        if self.path is not None:
            LOG.warning("%s: cached kernel not used because %s; compiling it again", self.path / name, fault)
            with suppress(OSError):
                (self.path / name).unlink()

    def write(self, name: str, content: bytes) -> None:
        """Replace a file atomically. The first failure is logged."""
        try:
            if self.path is not None:
                _replace(self.path / name, MAGIC + checksum(content) + content)
                return
        except OSError as error:
            if not self._full:
                self._full = True
                LOG.warning("%s: kernels can't be cached (%s)", self.path, error.strerror)
        if self.send is not None:
            self.send(name, content)

    def claim(self, name: str) -> bool:
        """Claim the right to compile a kernel. Return True if another process held it: read the file again then."""
        return self._claims is not None and self._claims.take(name, self._call_before_read)

    def release(self, name: str) -> None:
        """Give back the claim, after compiling or a failure."""
        if self._claims is not None:
            self._claims.release(name)

    def _call_before_read(self) -> None:
        if self.before_read is not None:
            self.before_read()

    def _log_remark(self) -> None:
        remark, self._remark = self._remark, ""
        if remark:
            LOG.warning("%s", remark)


_this_thread = threading.local()


@contextmanager
def cached_only() -> Iterator[None]:
    """Forbid compiling in this thread: a kernel that is not cached raises NotCached."""
    _this_thread.cached_only = True
    try:
        yield
    finally:
        _this_thread.cached_only = False


def require_compiling_allowed(kernel: str) -> None:
    """Raise NotCached inside `cached_only`."""
    if getattr(_this_thread, "cached_only", False):
        raise NotCached(kernel)


def checksum(content: bytes) -> bytes:
    """Return the checksum of a file's content, `CHECKSUM` bytes."""
    return hashlib.blake2b(content, digest_size=CHECKSUM).digest()


def _replace(path: Path, content: bytes) -> None:
    """Replace a file atomically, with mode 0600."""
    temporary = path.with_name(f"{path.name}.{uuid.uuid4().hex}.tmp")
    try:
        with open(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
            file.write(content)
        temporary.replace(path)
    except BaseException:
        with suppress(OSError):
            temporary.unlink()
        raise


def _read_own(path: Path) -> tuple[bytes, str]:
    """Return the content of a regular file of this user and "", or the fault of another file.

    Symbolic links are not followed, and a named pipe does not block.
    """
    with open(os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK), "rb") as file:
        info = os.fstat(file.fileno())
        if not stat.S_ISREG(info.st_mode):
            return b"", "it is not a plain file"
        if info.st_uid != os.geteuid() or info.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
            return b"", "another user can write it"
        return file.read(), ""
