# SPDX-License-Identifier: Apache-2.0
"""`conveyor-sim serve` as a separate process."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryFile

from protocols.waiting import PATIENCE, until
from warm import Warm

COMMAND = ["-c", "from conveyor_sim.cli import main; main()", "serve"]


class Served:
    """Process of `conveyor-sim serve`."""

    def __init__(self, folder: Path, *arguments: str, fresh: bool = False, **environment: str) -> None:
        """Start it in a separate folder. fresh: in a new Python, which an environment requires."""
        self.folder, self._log = folder, folder / "log"
        self._out = TemporaryFile("w+")  # noqa: SIM115  # read at the end
        with self._log.open("w") as log:
            if fresh or environment:  # which may be read while modules are imported
                self.process = subprocess.Popen(
                    [sys.executable, *COMMAND, *arguments],
                    cwd=folder,
                    env={**os.environ, **environment},
                    stdin=subprocess.DEVNULL,
                    stdout=self._out,
                    stderr=log,
                )
            else:
                self.process = Warm([*COMMAND, *arguments], self._out, log, cwd=folder)

    @property
    def told(self) -> str:
        """Return its output so far."""
        return self._log.read_text()

    @property
    def address(self) -> str:
        """Return the address of its first server, once it listens."""
        pattern = r"(modbus|opc\.tcp|ws)://127\.0\.0\.1:\d+"
        until(lambda: re.search(pattern, self.told) or self.process.poll() is not None, "the server")
        found = re.search(pattern, self.told)
        assert found, self.told
        return found.group()

    @property
    def port(self) -> int:
        """Return the port of its first server, once it listens."""
        return int(self.address.rpartition(":")[2])

    @property
    def simulator(self) -> int:
        """Return the process that simulates."""
        (pid,) = (pid for pid, command in self.children.items() if "scene_process" in command)
        return pid

    def server(self, protocol: str) -> int:
        """Return the process of a protocol server."""
        (pid,) = (pid for pid, command in self.children.items() if command.split("\0")[-2] == protocol)
        return pid

    @property
    def children(self) -> dict[int, str]:
        """Return the child processes with their command lines."""
        found = {}
        for task in Path(f"/proc/{self.process.pid}/task").glob("*/children"):
            with suppress(FileNotFoundError):  # a thread, or a child, that has just ended
                found |= {int(pid): Path(f"/proc/{pid}/cmdline").read_text() for pid in task.read_text().split()}
        return found

    def end(self, number: int = signal.SIGINT) -> str:
        """Send a signal, and return its complete output."""
        self.process.send_signal(number)
        self.process.wait(timeout=PATIENCE)
        self._out.seek(0)
        return self._out.read()
