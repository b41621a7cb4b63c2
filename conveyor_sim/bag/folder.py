"""Whether a folder can take a recording, found out before anything is simulated or compiled for it."""

from __future__ import annotations

import tempfile
from contextlib import suppress
from pathlib import Path

from conveyor_sim.errors import BagError


def require_recordable(path: Path) -> None:
    """Raises BagError unless a folder is empty or can be made, and can be written to. Nothing stays behind."""
    made: list[Path] = []
    try:
        for folder in [*reversed(path.absolute().parents), path.absolute()]:
            if not folder.is_dir():
                folder.mkdir()
                made.append(folder)
        if any(path.iterdir()):
            raise BagError(f"{path}: is not empty, expected a new or an empty folder to record into")
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        raise BagError(f"{path}: can't be created as the folder of a recording ({error.strerror})") from error
    finally:
        for folder in reversed(made):
            with suppress(OSError):
                folder.rmdir()
