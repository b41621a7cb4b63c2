"""`conveyor-sim serve` as a process of its own."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryFile

from scada.waiting import PATIENCE, until
from warm import Warm

COMMAND = ["-c", "from conveyor_sim.cli import main; main()", "serve"]


class Served:
    """One of them."""

    def __init__(self, folder: Path, *arguments: str, fresh: bool = False, **environment: str) -> None:
        """In a folder of its own. fresh: by a Python of its own, as it is where an environment is given."""
        self._log = folder / "log"
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
        (pid,) = self._children("scene_process")
        return pid

    @property
    def servers(self) -> list[int]:
        """Processes of protocol servers."""
        return self._children("server_process")

    def _children(self, module: str) -> list[int]:
        """Child processes that run a module."""
        tasks = Path(f"/proc/{self.process.pid}/task").glob("*/children")
        pids = {int(pid) for task in tasks for pid in task.read_text().split()}
        return [pid for pid in sorted(pids) if module in Path(f"/proc/{pid}/cmdline").read_text()]

    def end(self, number: int = signal.SIGINT) -> str:
        """What it printed, after a signal."""
        self.process.send_signal(number)
        self.process.wait(timeout=PATIENCE)
        self._out.seek(0)
        return self._out.read()
