"""Folders with the inputs of running tests. A test that is killed leaves its folder."""

from __future__ import annotations

import shutil
import tempfile
from contextlib import suppress
from itertools import count
from pathlib import Path

from conveyor_sim.bag.input_log import input_folders
from conveyor_sim.bag.lock import alone
from conveyor_sim.errors import BagError

UNFINISHED = ".unfinished"


def make_folder(place: Path) -> Path:
    """Return a new folder beside the folder for a failed test, or else in the temporary folder of the system."""
    try:
        for number in count(1):
            folder = place.with_name(f"{place.name}{UNFINISHED}{'' if number == 1 else f'_{number}'}")
            place.parent.mkdir(parents=True, exist_ok=True)
            # Another process may have made this folder, or just have removed the empty folder above.
            with suppress(FileExistsError, FileNotFoundError):
                folder.mkdir()
                return folder
    except OSError:
        pass
    return Path(tempfile.mkdtemp(prefix="conveyor_sim_"))


def remove_folder(folder: Path) -> None:
    """Remove a folder of `make_folder`, and the folder above if it is empty."""
    shutil.rmtree(folder, ignore_errors=True)
    if UNFINISHED in folder.name:
        with suppress(OSError):
            folder.parent.rmdir()


def left_over(root: Path) -> list[Path]:
    """Return the folders that killed tests left, without those from which a bag was made."""
    return [folder for folder in sorted(root.glob(f"*{UNFINISHED}*")) if _is_left(folder)]


def _is_left(folder: Path) -> bool:
    parts = [part for part in input_folders(folder) if not (part / "bag").exists()]
    try:
        for part in parts:
            with alone(part / "inputs.jsonl"):
                pass
    except (BagError, OSError):
        return False  # its test is running
    return bool(parts)
