"""Folders with the inputs of tests that are under way: a test that is killed leaves its own."""

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
    """A new folder beside the one for what a failed test leaves; in the system's temporary folder if it can't be."""
    try:
        for number in count(1):
            folder = place.with_name(f"{place.name}{UNFINISHED}{'' if number == 1 else f'_{number}'}")
            place.parent.mkdir(parents=True, exist_ok=True)
            # Another process may have one of this name, or just have removed the empty folder above.
            with suppress(FileExistsError, FileNotFoundError):
                folder.mkdir()
                return folder
    except OSError:
        pass
    return Path(tempfile.mkdtemp(prefix="conveyor_sim_"))


def remove_folder(folder: Path) -> None:
    """Remove such a folder, and the one above if nothing else is in it."""
    shutil.rmtree(folder, ignore_errors=True)
    if UNFINISHED in folder.name:
        with suppress(OSError):
            folder.parent.rmdir()


def left_over(root: Path) -> list[Path]:
    """The folders that killed tests have left and of which no bag was made."""
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
