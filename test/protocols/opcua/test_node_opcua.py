# SPDX-License-Identifier: Apache-2.0
"""node-opcua, an implementation of OPC UA in JavaScript, as a client."""

from __future__ import annotations

import json
import os
import queue
import shutil
import subprocess
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from conveyor_sim.line.machines.packml import STATE_TEXTS
from conveyor_sim.protocols.opcua.server import OpcUaServer
from test.protocols.opcua.conftest import PASSWORD, PATIENCE

if TYPE_CHECKING:
    from test.protocols.opcua.conftest import Line, Serve

CLIENT = Path(__file__).parent / "node_client"

pytestmark = pytest.mark.skipif(
    shutil.which("node") is None or not (CLIENT / "node_modules").is_dir(),
    reason=f"node-opcua is not installed: npm install --no-package-lock --prefix {CLIENT}",
)


def run(line: Line, user: str, password: str, folder: Path) -> subprocess.CompletedProcess[str]:
    command = ["node", str(CLIENT / "client.js"), line.server.address, user, password, str(folder)]
    home = {**os.environ, "HOME": str(folder), "XDG_CONFIG_HOME": str(folder)}
    return subprocess.run(command, capture_output=True, text=True, timeout=300, env=home, check=False)


def test_it_reads_writes_subscribes_and_calls(line: Line, tmp_path: Path) -> None:
    line.client()
    line.advance(7)
    done = run(line, "controller", PASSWORD, tmp_path)
    assert done.returncode == 0, done.stderr
    told: dict[str, Any] = json.loads(next(row for row in done.stdout.splitlines() if row.startswith("{")))
    assert told["namespaces"][2] == "urn:conveyor_sim:line"
    assert {"speed", "cmd_speed", "running", "mode"} <= set(told["children"])
    shown = line.source.snapshot.values
    assert told["speed"] == {"value": shown["belts/zone1/cmd_speed"], "type": "Double", "status": "Good"}
    assert told["bottles"] == {"value": shown["belts/zone1/bottles"], "type": "UInt32", "status": "Good"}
    assert told["running"] == {"value": True, "type": "Boolean", "status": "Good"}
    assert told["unit"] == [5067859, "m/s"] and told["range"] == [0, 1]
    assert told["states"] == list(STATE_TEXTS.values())
    assert told["tick"] == 7 and told["stamped"]
    codes = [told[name] for name in ("good", "beyond", "wrong", "signal", "called", "mode")]
    later = "GoodCompletesAsynchronously"
    assert codes == [later, "BadOutOfRange", "BadTypeMismatch", "BadNotWritable", later, "BadUserAccessDenied"]
    line.advance()
    assert [row[:4] for row in line.outcomes()] == [
        ("opcua controller", "disown", (), ()),
        ("opcua controller", "set", ("belts/zone1/cmd_speed",), (0.125,)),
    ]


def test_an_operator_takes_a_belt_by_writing_only(line: Line, tmp_path: Path) -> None:
    line.client()
    done = run(line, "operator", PASSWORD, tmp_path)
    told = json.loads(next(row for row in done.stdout.splitlines() if row.startswith("{")))
    assert (told["mode"], told["good"]) == ("GoodCompletesAsynchronously", "BadUserAccessDenied"), done.stderr
    line.advance()
    assert line.read("belts/zone2/mode") == 3


def test_it_is_refused_with_a_wrong_password(line: Line, tmp_path: Path) -> None:
    done = run(line, "controller", "open sesam", tmp_path)
    assert done.returncode == 1 and "BadUserAccessDenied" in done.stderr


class Follower:
    """node-opcua, following the tick of a line."""

    def __init__(self, line: Line, folder: Path) -> None:
        command = ["node", str(CLIENT / "follow.js"), line.server.address]
        home = {**os.environ, "HOME": str(folder), "XDG_CONFIG_HOME": str(folder)}
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT, text=True, env=home)
        self.lines: queue.Queue[str] = queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()

    def see(self, wanted: str) -> None:
        """Wait until it prints that."""
        while self.lines.get(timeout=PATIENCE) != wanted:
            pass

    def end(self) -> None:
        """Ask it to disconnect, and wait for its end."""
        with self.process:
            assert self.process.stdin is not None
            self.process.stdin.close()
            try:
                self.process.wait(PATIENCE)
            finally:
                self.process.kill()

    def _read(self) -> None:
        for row in self.process.stdout or ():
            self.lines.put(row.strip())


def test_it_sees_values_again_after_the_server_was_restarted(serve: Serve, certificates: Path, tmp_path: Path) -> None:
    """Its subscription is gone, and another client has its id, so it must create a new one."""
    line = serve()
    line.client()
    line.advance(3)
    follower = Follower(line, tmp_path)
    try:
        follower.see("3")
        line.advance()
        follower.see("4")
        port = line.server.port
        line.open.clear()
        line.thread.run(line.server.stop())
        line.server = OpcUaServer(line.source, certificates=certificates, port=port)
        line.thread.run(line.server.start())
        others = [line.client().create_subscription(20, None) for _ in range(3)]
        follower.see("again")
        follower.see("4")
        line.advance()
        follower.see("5")
        assert len(others) == 3 and line.clients[1] == 4
    finally:
        follower.end()
