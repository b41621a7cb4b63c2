"""`BirthNumbers`: the number of each connection (bdSeq), which goes on where an earlier process left off.

Hosts match the death of a connection with its birth by this number (Sparkplug 3.0, 6.4.5 and 6.4.19). The will of a
killed process may arrive after the births of the next process, so both must have different numbers.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import secrets
from pathlib import Path

from conveyor_sim.support.checked_json import parsed
from conveyor_sim.support.file_lock import locked
from conveyor_sim.support.files import FileError, read_file, write_file

COUNT = 256
"""Numbers go from 0 to COUNT - 1, and round."""

_MOST_BYTES = 10_000
_PATIENCE = 2.0
"""Wall time to wait for another process that counts, s."""


def state_folder() -> Path:
    """Return `conveyor_sim/mqtt` in the folder for the state of this user ($XDG_STATE_HOME, else ~/.local/state)."""
    base = os.environ.get("XDG_STATE_HOME", "")
    return (Path(base) if os.path.isabs(base) else Path.home() / ".local" / "state") / "conveyor_sim" / "mqtt"


class BirthNumbers:
    """Numbers of the connections of one edge node to one broker, from all its processes."""

    def __init__(self, broker: str, group: str, node: str, folder: Path | None = None) -> None:
        """Prepare the numbers. broker: its address. group, node: IDs. folder: holds one file per edge node; None:
        `state_folder()`.
        """
        self._node = {"broker": broker, "group": group, "node": node}
        self._folder = folder
        digest = hashlib.sha256(json.dumps(self._node, sort_keys=True).encode()).hexdigest()
        self._file = Path(f"{digest[:32]}.json")
        self._next = secrets.randbelow(COUNT)  # without a file
        self._remarked = False

    def take(self) -> int:
        """Return the number of the next connection, once it is on the disk.

        Without a folder to write to, numbers begin at a random one, with one warning in the log.
        """
        try:
            folder = state_folder() if self._folder is None else self._folder
            folder.mkdir(parents=True, exist_ok=True)
            with locked(folder, _PATIENCE):
                number = self._read(folder)
                content = {**self._node, "bdSeq": number}
                write_file(self._file, json.dumps(content).encode() + b"\n", folder)
        except BlockingIOError:
            self._remark("the folder is locked by another process")
            number = self._next
        except (FileError, OSError, RuntimeError) as error:
            self._remark(str(error))
            number = self._next
        self._next = (number + 1) % COUNT
        return number

    def _read(self, folder: Path) -> int:
        """Return the number after the last one that was used: 0 for the first."""
        if not (folder / self._file).exists():
            return 0
        try:
            last = parsed(read_file(self._file, _MOST_BYTES, folder))["bdSeq"]
        except (FileError, TypeError, KeyError):
            last = None
        if type(last) is not int or not 0 <= last < COUNT:
            self._remark("its last number can't be read")
            return self._next
        return (last + 1) % COUNT

    def _remark(self, reason: str) -> None:
        if not self._remarked:
            self._remarked = True
            place = self._folder or "$XDG_STATE_HOME/conveyor_sim/mqtt"
            text = "mqtt: %s: %s, expected a folder that keeps bdSeq from run to run; it begins with %d"
            logging.getLogger(__name__).warning(text, place, reason, self._next)
