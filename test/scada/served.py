"""`conveyor-sim serve` as a process of its own."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

from scada.waiting import PATIENCE, until

COMMAND = [sys.executable, "-c", "from conveyor_sim.cli import main; main()", "serve"]


class Served:
    """One of them."""

    def __init__(self, folder: Path, *arguments: str, **environment: str) -> None:
        """In a folder of its own."""
        self._log = folder / "log"
        with self._log.open("w") as log:
            self.process = subprocess.Popen(
                [*COMMAND, *arguments],
                cwd=folder,
                env={**os.environ, **environment},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
            )

    @property
    def told(self) -> str:
        """What it has said so far."""
        return self._log.read_text()

    @property
    def address(self) -> str:
        """Of its first server, once it listens."""
        pattern = r"(modbus|opc\.tcp|ws)://127\.0\.0\.1:\d+"
        until(lambda: re.search(pattern, self.told) or self.process.poll() is not None, "the server")
        found = re.search(pattern, self.told)
        assert found, self.told
        return found.group()

    @property
    def port(self) -> int:
        """The same."""
        return int(self.address.rpartition(":")[2])

    @property
    def simulator(self) -> int:
        """The process that simulates."""
        tasks = Path(f"/proc/{self.process.pid}/task").glob("*/children")
        (pid,) = {pid for task in tasks for pid in task.read_text().split()}
        return int(pid)

    def end(self, number: int = signal.SIGINT) -> str:
        """What it printed, after a signal."""
        self.process.send_signal(number)
        return self.process.communicate(timeout=PATIENCE)[0]
