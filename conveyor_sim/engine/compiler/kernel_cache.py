"""Compiled kernels on disk: one file for each kernel and its types, with a checksum.

Numba's own cache unpickles whatever it finds, and lets two processes that compile at the same time give one file to
two kernels. Here a file's name comes from all that the machine code depends on, and a file that is damaged, or not
ours, is a miss: it is deleted and compiled again.
"""

import functools
import hashlib
import inspect
import logging
import os
import pickle
import stat
import sys
import threading
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import llvmlite
import numba
from numba.core import compiler, serialize
from numba.core.caching import _Cache
from numba.core.runtime.nrt import rtsys

from conveyor_sim.engine.compiler.claims import Claims

# Untyped in numba.
_rebuild: Any = compiler.CompileResult._rebuild
_dumps: Any = serialize.dumps

LOG = logging.getLogger("conveyor_sim")
MAGIC = b"conveyor_sim kernel 1\n"
CHECKSUM = 32
"""Bytes of a checksum (BLAKE2b)."""


class NotCached(Exception):
    """A kernel that would have to be compiled, inside of `cached_only`."""


class KernelFolder:
    """Files by name in a folder. What can't be written, or without a folder, can be sent to another process instead."""

    def __init__(self, path: Path | None, remark: str) -> None:
        """remark: logged when the first kernel is needed, "" for nothing."""
        self.path = path
        self._remark = remark
        self._full = False
        self._claims = None if path is None else Claims(path)
        self.received: dict[str, bytes] = {}
        """What a process that compiles for this one has sent."""
        self.send: Callable[[str, bytes], object] | None = None
        """To that process, in the one that compiles."""
        self.before_read: Callable[[], object] | None = None
        """Called before each kernel; what it raises ends the compiling or loading under way."""

    def use(self, path: Path | None) -> None:
        """Another folder from now on, or none."""
        self.path, self._remark = path, ""
        self._claims = None if path is None else Claims(path)

    def read(self, name: str) -> bytes | None:
        """What was written under a name; None if there is nothing that can be used."""
        self._look()
        self._tell_remark()
        if self.path is None or name in self.received:
            return self.received.get(name)
        path = self.path / name
        try:
            content, why = _read_own(path)
        except FileNotFoundError:
            return None
        except OSError as error:
            content, why = b"", f"it can't be read ({error.strerror})"
        if not why:
            start = len(MAGIC) + CHECKSUM
            if content[:start] == MAGIC + _checksum(content[start:]):
                return content[start:]
            why = "it is damaged"
        self.discard(name, why)
        return None

    def discard(self, name: str, why: str) -> None:
        """Delete a file that can't be used."""
        if self.path is not None:
            LOG.warning("%s: cached kernel not used, for %s; compiling it again", self.path / name, why)
            with suppress(OSError):
                (self.path / name).unlink()

    def write(self, name: str, content: bytes) -> None:
        """Replace a file in one go. If it can't be written that is logged once, and the kernel is compiled again."""
        try:
            if self.path is not None:
                _replace(self.path / name, MAGIC + _checksum(content) + content)
                return
        except OSError as error:
            if not self._full:
                self._full = True
                LOG.warning("%s: kernels can't be cached (%s)", self.path, error.strerror)
        if self.send is not None:
            self.send(name, content)

    def claim(self, name: str) -> bool:
        """This process is to compile it. Returns whether another one did until now: then read again."""
        return self._claims is not None and self._claims.take(name, self._look)

    def release(self, name: str) -> None:
        """It has compiled it, or failed."""
        if self._claims is not None:
            self._claims.give_back(name)

    def _look(self) -> None:
        if self.before_read is not None:
            self.before_read()

    def _tell_remark(self) -> None:
        remark, self._remark = self._remark, ""
        if remark:
            LOG.warning("%s", remark)


class KernelCache(_Cache):
    """What numba asks before it compiles a function, and tells afterwards."""

    def __init__(self, function: Any, options: dict[str, bool], folder: KernelFolder) -> None:
        self._function = function
        self._options = tuple(sorted(options.items()))
        self._folder = folder
        self._claimed: str | None = None

    @property
    def cache_path(self) -> str | None:
        """Where the files are."""
        return None if self._folder.path is None else str(self._folder.path)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The machine code for arguments of these types; None if it is not there. Raises NotCached."""
        # Not all of numba's tables, as numba does here: those are for compiling, which reads them itself.
        rtsys.initialize(target_context)
        key = self._key(sig, target_context.codegen())
        name = self._name(key)
        loaded = self._load(name, key, target_context)
        if loaded is None and getattr(_only, "cached", False):
            raise NotCached(self._function.__qualname__)
        if loaded is None:
            self._claimed = name
            if self._folder.claim(name):
                loaded = self._load(name, key, target_context)
        return loaded

    def release(self) -> None:
        """End the claim to what was looked for and not found: it is compiled now, or can't be."""
        name, self._claimed = self._claimed, None
        if name is not None:
            self._folder.release(name)

    def _load(self, name: str, key: tuple[Any, ...], target_context: Any) -> Any:
        payload = self._folder.read(name)
        if payload is not None:
            try:
                found, result = pickle.loads(payload)
                if found == key:
                    return _rebuild(target_context, *result)
                why = "it is of other types"
            except Exception as error:  # whatever a file that others wrote makes of pickle, numba or LLVM
                why = f"it can't be loaded ({type(error).__name__})"
            self._folder.discard(name, why)
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep machine code."""
        if not data.library.has_dynamic_globals:
            key = self._key(sig, data.codegen)
            self._folder.write(self._name(key), _dumps((key, data._reduce())))

    def enable(self) -> None:
        """It always is."""

    def disable(self) -> None:
        """It never is."""

    def flush(self) -> None:
        """Files of other content have other names."""

    def _key(self, sig: Any, codegen: Any) -> tuple[Any, ...]:
        """All that the machine code depends on, beside the engine's sources, which name the folder."""
        cells = tuple(cell.cell_contents for cell in self._function.__closure__ or ())
        versions = (numba.__version__, llvmlite.__version__, sys.version)
        source = _source(inspect.getfile(self._function)), self._function.__code__.co_firstlineno
        return sig, codegen.magic_tuple(), versions, self._options, source, _dumps(cells)

    def _name(self, key: tuple[Any, ...]) -> str:
        module = Path(inspect.getfile(self._function)).stem
        digest = hashlib.blake2b(repr(key).encode(), digest_size=16).hexdigest()
        return f"{module}.{self._function.__qualname__}-{digest}.kernel"


@contextmanager
def cached_only() -> Iterator[None]:
    """In this thread, raise NotCached for a kernel that would have to be compiled."""
    _only.cached = True
    try:
        yield
    finally:
        _only.cached = False


_only = threading.local()


@functools.cache
def _source(path: str) -> bytes:
    return _checksum(Path(path).read_bytes())


def _checksum(content: bytes) -> bytes:
    return hashlib.blake2b(content, digest_size=CHECKSUM).digest()


def _replace(path: Path, content: bytes) -> None:
    """Write a file in one go, for this user only."""
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
    """The content of a plain file of ours, or why it is not one. Neither a link nor a pipe is followed."""
    with open(os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK), "rb") as file:
        info = os.fstat(file.fileno())
        if not stat.S_ISREG(info.st_mode):
            return b"", "it is not a plain file"
        if info.st_uid != os.geteuid() or info.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
            return b"", "another user can write it"
        return file.read(), ""
