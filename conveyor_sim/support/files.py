# SPDX-License-Identifier: Apache-2.0
"""Files with paths from users: read up to a limit, written atomically, and confined to a folder on request.

A path may lead to a pipe without a writer, to a device without end, or by a link out of the folder. So a path is first
opened without access (O_PATH), which has no side effects. The opened file is checked and then read, so it can't be
replaced in between.
"""

import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import BinaryIO
from uuid import uuid4

MB = 1_000_000

_KINDS = {
    stat.S_IFDIR: "is a folder",
    stat.S_IFIFO: "is a named pipe, not a regular file",
    stat.S_IFSOCK: "is a socket, not a regular file",
    stat.S_IFCHR: "is a device, not a regular file",
    stat.S_IFBLK: "is a device, not a regular file",
}


Objection = Callable[[BinaryIO], str]
"""Check of an open file. Returns why it may not be replaced, in words that follow its path; "" if it may."""


class FileError(Exception):
    """Error: a file can't be read or written. The text follows its path: "is a folder"."""


class OutsideError(FileError):
    """Error: a file lies outside its folder."""


_noted: ContextVar[set[Path] | None] = ContextVar("noted", default=None)


@contextmanager
def noting_files() -> Iterator[set[Path]]:
    """Collect the paths that `read_file` is asked for in this thread, whether or not the files can be read."""
    paths: set[Path] = set()
    token = _noted.set(paths)
    try:
        yield paths
    finally:
        _noted.reset(token)


def read_file(path: Path, most: int, folder: Path | None = None) -> bytes:
    """Return the content of a regular file of at most `most` bytes. Never waits for another process.

    folder: where relative paths start, and which no path may leave, by `..` or by a link; None: anywhere.
    Raises FileError.
    """
    if (noted := _noted.get()) is not None:
        noted.add(path if folder is None else folder / path)
    try:
        descriptor = os.open(_in_folder(path, folder), os.O_PATH | os.O_CLOEXEC)
        try:
            _require_below(descriptor, folder)
            entry = os.fstat(descriptor)
            if not stat.S_ISREG(entry.st_mode):
                raise FileError(_KINDS.get(stat.S_IFMT(entry.st_mode), "is not a regular file"))
            # Some regular files of the kernel wait for news, without O_NONBLOCK.
            with open(os.open(_of(descriptor), os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as stream:
                # It may grow while it is read.
                content = b"" if entry.st_size > most else (stream.read(most + 1) or b"")
        finally:
            os.close(descriptor)
    except FileNotFoundError:
        raise FileError("no such file") from None
    except (OSError, ValueError) as error:
        raise FileError(f"can't be read ({_reason(error)})") from error
    size = max(entry.st_size, len(content))
    if size > most:
        raise FileError(f"has {in_mb(size)}, more than the {in_mb(most)} that are read")
    return content


def write_file(
    path: Path,
    content: bytes,
    folder: Path | None = None,
    objection: Objection | None = None,
    mode: int = 0o666,
) -> None:
    """Write a file atomically: it is complete and on the disk, or the previous file is untouched.

    A link of that name is replaced, not followed. folder: as for `read_file`; it is made if it is missing.
    objection: checks a file of that name, or the target of a link of that name; None: any file is replaced.
    mode: permissions, which the umask reduces. Raises FileError.
    """
    try:
        if folder is not None:
            os.makedirs(folder, exist_ok=True)
        place = _in_folder(path, folder)
        if os.path.isdir(place):
            raise FileError("is a folder")
        parent = os.open(place.parent, os.O_PATH | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            _require_below(parent, folder)
            _replace(parent, place.name, content, objection, mode)
        finally:
            os.close(parent)
    except (OSError, ValueError) as error:
        raise FileError(f"can't be written ({_reason(error)})") from error


def in_mb(size: int) -> str:
    """Return a size in bytes for a message."""
    return f"{size / MB:.3g} MB" if size < 1000 * MB else f"{size / MB:.0f} MB"


def _replace(parent: int, name: str, content: bytes, objection: Objection | None, mode: int) -> None:
    _is_there(parent, name, objection)  # a refusal costs no write
    unfinished = f".{uuid4().hex}.unfinished"
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
    try:
        with open(os.open(unfinished, flags, mode, dir_fd=parent), "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        # Another program may have put a file there while this one was written.
        if _is_there(parent, name, objection) or objection is None or not _linked(parent, unfinished, name):
            _is_there(parent, name, objection)
            os.replace(unfinished, name, src_dir_fd=parent, dst_dir_fd=parent)
    finally:
        with suppress(OSError):
            os.unlink(unfinished, dir_fd=parent)


def _linked(parent: int, unfinished: str, name: str) -> bool:
    """Give a finished file its name, which must be free. Return False if it is taken or there are no hard links."""
    try:
        os.link(unfinished, name, src_dir_fd=parent, dst_dir_fd=parent, follow_symlinks=False)
    except OSError:
        return False
    return True


def _is_there(parent: int, name: str, objection: Objection | None) -> bool:
    """Return True if there is a file of that name. Raise FileError if it may not be replaced."""
    try:
        kind = stat.S_IFMT(os.stat(name, dir_fd=parent, follow_symlinks=False).st_mode)
    except FileNotFoundError:
        return False
    if kind in _KINDS:
        raise FileError(_KINDS[kind])
    if objection is None:
        return True
    try:
        opened = os.open(name, os.O_PATH | os.O_CLOEXEC, dir_fd=parent)
    except FileNotFoundError:
        if kind == stat.S_IFLNK:
            raise FileError("is a link to a file that does not exist") from None
        return False  # another program removed it in between
    try:
        kind = stat.S_IFMT(os.fstat(opened).st_mode)
        if kind in _KINDS:
            raise FileError(f"is a link, and its target {_KINDS[kind]}")
        with open(os.open(_of(opened), os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as stream:
            reason = objection(stream)
    finally:
        os.close(opened)
    if reason:
        raise FileError(reason)
    return True


def _in_folder(path: Path, folder: Path | None) -> Path:
    """Return the path to open. Raise OutsideError if its text leads out of the folder."""
    if folder is None:
        return path
    place = Path(os.path.normpath(os.path.join(os.path.abspath(folder), path)))
    if not any(place.is_relative_to(root) for root in (os.path.abspath(folder), os.path.realpath(folder))):
        raise OutsideError(f"leads out of the folder {folder}")
    return place


def _require_below(opened: int, folder: Path | None) -> None:
    """Raise OutsideError if an open file lies outside the folder, links followed."""
    if folder is not None and not Path(os.readlink(_of(opened))).is_relative_to(os.path.realpath(folder)):
        raise OutsideError(f"leads out of the folder {folder}")


def _of(opened: int) -> str:
    return f"/proc/self/fd/{opened}"


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or "not a path"
