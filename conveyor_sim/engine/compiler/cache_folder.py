# SPDX-License-Identifier: Apache-2.0
"""Folder of the kernel cache.

Cached kernels are unpickled and run. Only a folder of this user with mode 0700 is used, so that no other user can add a
file to it. That mode also disables entries of access control lists, because its group bits mask them.
"""

import os
import stat
from contextlib import suppress
from pathlib import Path


def choose_cache_folder(name: str) -> tuple[Path | None, str]:
    """Return the folder `conveyor_sim/<name>` of the cache and "", or None and the reason why there is no cache.

    The cache lies under NUMBA_CACHE_DIR, else under XDG_CACHE_HOME, else under ~/.cache. Missing folders are created.
    """
    try:
        base = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        own = Path(base).absolute() / "conveyor_sim"
        own.parent.mkdir(parents=True, exist_ok=True)
        reason = _refusal(own) or _refusal(own / name)
    except RuntimeError:
        reason = "this user has no home folder"
    except OSError as error:
        reason = f"{error.filename} can't be used ({error.strerror})"
    return (None, f"kernels are not cached, so every start compiles them: {reason}") if reason else (own / name, "")


def _refusal(folder: Path) -> str:
    """Return why a folder can't hold kernels, "" if it can. Create it if it is missing."""
    with suppress(FileExistsError):
        folder.mkdir(mode=0o700)
    info = folder.lstat()
    mode = stat.S_IMODE(info.st_mode) & 0o777
    if stat.S_ISLNK(info.st_mode):
        fault = "is a symbolic link"
    elif not stat.S_ISDIR(info.st_mode):
        fault = "is not a folder"
    elif info.st_uid != os.geteuid():
        fault = f"belongs to user {info.st_uid}"
    elif mode != 0o700:
        fault = f"has mode {mode:04o}"
    else:
        return ""
    return f"{folder} {fault}, expected a folder of user {os.geteuid()} with mode 0700"
