"""Which folder may hold compiled kernels: one in which no other user can put a file.

Cached kernels are unpickled and run, so whoever can write into their folder can run code as its user.
"""

import grp
import os
import pwd
import stat
import tempfile
from contextlib import suppress
from pathlib import Path

LINKS = 40
"""Symbolic links in one path at most, as in the kernel."""


class Unfit(Exception):
    """A folder that can't be used, and why."""


def choose_cache_folder(name: str) -> tuple[Path | None, str]:
    """A folder `conveyor_sim/<name>` of our own, mode 0700, and a remark for the log, "" if all is as asked for.

    Under NUMBA_CACHE_DIR, XDG_CACHE_HOME or the home's cache; else a temporary folder of this user; None: neither will
    do.
    """
    reasons = []
    for find in (_asked, _temporary):
        try:
            folder = own_folder(find(), name)
        except Unfit as error:
            reasons.append(str(error))
        else:
            return folder, f"kernels are cached in {folder}, for {reasons[0]}" if reasons else ""
    return None, f"kernels are not cached, so every start compiles them: {'; '.join(reasons)}"


def own_folder(parent: Path, name: str) -> Path:
    """`<parent>/<name>`, made if need be: both ours, mode 0700, where no other user can put anything. Raises Unfit."""
    folder = parent / name
    try:
        _make_safely(folder)
        for ours in (parent, folder):
            _claim(ours)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError as error:
        raise Unfit(f"{error.filename or folder} can't be written ({error.strerror})") from error


def others_can_write(info: os.stat_result, path: str) -> bool:
    """Whether a user other than its owner and root can write to what is at a path; `info`: its os.lstat."""
    if info.st_mode & stat.S_IWOTH:
        return True
    return bool(info.st_mode & stat.S_IWGRP) and not _is_private_group(info.st_gid, info.st_uid, path)


def _asked() -> Path:
    try:
        base = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    except RuntimeError as error:
        raise Unfit("this user's home is not known") from error
    return Path(base).absolute() / "conveyor_sim"


def _temporary() -> Path:
    try:
        return Path(tempfile.gettempdir()).absolute() / f"conveyor_sim-{os.geteuid()}"
    except OSError as error:
        raise Unfit(f"there is no temporary folder ({error.strerror})") from error


def _make_safely(folder: Path) -> None:
    """Make a folder and its parents, for this user only, where they are missing.

    Raises Unfit if another user could put something else at this path, or at any that its links lead through.
    """
    rest, here, links = list(reversed(folder.parts[1:])), "/", 0
    _require_folder(os.lstat(here), here)
    while rest:
        name = rest.pop()
        if name == "..":
            here = os.path.dirname(here)
            continue
        path = os.path.join(here, name)
        info = _made(path)
        # In a sticky folder, such as /tmp, nobody can take away or replace what is not his own.
        if info.st_uid not in (0, os.geteuid()):
            raise Unfit(f"{path} belongs to {_user(info.st_uid)}")
        if stat.S_ISLNK(info.st_mode):
            links += 1
            if links > LINKS:
                raise Unfit(f"{path} leads through more than {LINKS} links")
            target = Path(os.readlink(path))
            if target.is_absolute():
                here = "/"
            rest += reversed(target.parts[1:] if target.is_absolute() else target.parts)
        else:
            _require_folder(info, path)
            here = path


def _made(path: str) -> os.stat_result:
    """What is at a path: a new folder if there was nothing."""
    try:
        return os.lstat(path)
    except FileNotFoundError:
        with suppress(FileExistsError):  # another process was faster
            os.mkdir(path, 0o700)
        return os.lstat(path)


def _require_folder(info: os.stat_result, path: str) -> None:
    if not stat.S_ISDIR(info.st_mode):
        raise Unfit(f"{path} is not a folder")
    if not info.st_mode & stat.S_ISVTX and others_can_write(info, path):
        raise Unfit(f"others can write to {path} (mode {stat.S_IMODE(info.st_mode):04o})")


def _claim(folder: Path) -> None:
    """Make sure that a folder is ours alone. It must not have been open to others: they may have left something."""
    info = os.lstat(folder)
    if stat.S_ISLNK(info.st_mode):
        raise Unfit(f"{folder} is a link, expected a folder")
    if info.st_uid != os.geteuid():
        raise Unfit(f"{folder} belongs to {_user(info.st_uid)}")
    if others_can_write(info, str(folder)):
        raise Unfit(f"others can write to {folder} (mode {stat.S_IMODE(info.st_mode):04o})")
    if stat.S_IMODE(info.st_mode) != 0o700:
        folder.chmod(0o700)


def _is_private_group(gid: int, uid: int, path: str) -> bool:
    """Whether a group has its user only, as many distributions give one to each; an access list may name others."""
    try:
        group, user = grp.getgrgid(gid), pwd.getpwuid(uid)
        listed = "system.posix_acl_access" in os.listxattr(path, follow_symlinks=False)
    except (KeyError, OSError):
        return False
    return not listed and gid == user.pw_gid and group.gr_name == user.pw_name and set(group.gr_mem) <= {user.pw_name}


def _user(uid: int) -> str:
    try:
        return f"user {pwd.getpwuid(uid).pw_name}"
    except KeyError:
        return f"user {uid}"
