# SPDX-License-Identifier: Apache-2.0
"""Ten clients on 500 tags, of which 50 change ten times a second for 20 s: none misses a change, and memory stays flat.

The line waits for its clients, so that this holds on a busy machine too; `make bench ARGS=scada` measures one that does
not wait.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

pytest.importorskip("asyncua", reason="asyncua is not installed: pip install conveyor-sim[scada]")
pytest.importorskip("pymodbus", reason="pymodbus is not installed: pip install conveyor-sim[scada]")

from protocols.load_clients import QUEUE
from protocols.waiting import PATIENCE, until

from bench.scada import CHANGING, CLIENTS, EVERY, KINDS, TICK, Counting
from conveyor_sim.protocols.hosting.serving import Serving
from conveyor_sim.protocols.hosting.settings import ServerSettings

ROOT = Path(__file__).parents[3]
CHANGES = 200
AHEAD = {"opcua": QUEUE // 2, "modbus": 0}
"""Changes by which the line may be ahead of the slowest client; none for clients that poll."""
MEMORY = 5e6
"""Growth of memory in the second half, bytes; a hundred bytes for each notification would be as much."""


class Clients:
    """Clients of one protocol, in a separate process."""

    def __init__(self, name: str, address: str) -> None:
        command = [sys.executable, "-m", "protocols.load_clients", address, str(CHANGES)]
        path = os.pathsep.join((str(ROOT), str(ROOT / "test")))
        self.process = subprocess.Popen(
            command, cwd=ROOT, env={**os.environ, "PYTHONPATH": path}, stdout=subprocess.PIPE, text=True
        )
        self.name = name
        self._reached = -1
        self._told: list[list[int]] = []
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            found = json.loads(line)
            if isinstance(found, int):
                self._reached = found
            else:
                self._told = found

    def wait_for(self, change: int) -> None:
        """Wait until all clients have seen all tags at a value."""
        until(lambda: self._reached >= change, f"change {change} at all clients of {self.name}")

    def told(self) -> list[list[int]]:
        """Return the changes that each client has seen and lost, at the end."""
        assert self.process.wait(PATIENCE) == 0, self.name
        until(lambda: self._told, "what they have seen")
        return self._told


def resident() -> int:
    """Return the resident memory of this process, bytes."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def test_no_client_that_keeps_up_misses_a_change_and_memory_stays_flat() -> None:
    source, memory = Counting(), 0
    with Serving(source, [(kind, 0) for kind in KINDS], ServerSettings()) as serving:
        names = [kind.name for kind in KINDS]
        clients = {name: Clients(name, face.address) for name, face in zip(names, serving.hosts, strict=True)}
        try:
            for those in clients.values():
                those.wait_for(0)
            due = time.monotonic()
            for tick in range(1, CHANGES * EVERY + 1):
                change, left = divmod(tick, EVERY)
                if left == 0:
                    for name, those in clients.items():
                        those.wait_for(change - 1 - AHEAD[name])
                due += TICK
                time.sleep(max(0.0, due - time.monotonic()))
                source.show(tick)
                if change == CHANGES // 2 and not memory:
                    memory = resident()
            for those in clients.values():
                assert those.told() == [[CHANGES * CHANGING, 0]] * CLIENTS, those.name
        finally:
            for those in clients.values():
                those.process.kill()
                those.process.wait()
        assert resident() - memory < MEMORY
