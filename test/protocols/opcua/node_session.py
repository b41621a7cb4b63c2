# SPDX-License-Identifier: Apache-2.0
"""A session of node-opcua that a test drives, request by request."""

from __future__ import annotations

import json
import os
import queue
import shutil
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from test.protocols.opcua.conftest import PASSWORD, PATIENCE

CLIENT = Path(__file__).parent / "node_client"

needs_node_opcua = pytest.mark.skipif(
    shutil.which("node") is None or not (CLIENT / "node_modules").is_dir(),
    reason=f"node-opcua is not installed: npm install --no-package-lock --prefix {CLIENT}",
)


class NodeSession:
    """Session of node-opcua in a process of its own. node_client/session.js has the requests."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process
        self._lines: queue.Queue[str] = queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()

    def ask(self, what: str, **details: Any) -> Any:
        """Return the answer to a request. An error of node-opcua fails the test."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps({"do": what, **details}) + "\n")
        self._process.stdin.flush()
        while not (line := self._lines.get(timeout=PATIENCE)).startswith('{"answer":'):
            pass  # a warning of the library
        answer = json.loads(line)["answer"]
        assert not (isinstance(answer, dict) and "error" in answer), answer
        return answer

    def read(self, name: str, attribute: str = "Value") -> Any:
        """Return value, type, dimensions, status and time stamp of a node of the line."""
        return self.ask("read", node=name if "=" in name else f"ns=2;s={name}", attribute=attribute)

    def call(self, target: str, method: str, *inputs: tuple[str, Any]) -> str:
        """Call a method of an object of the line. Return the name of the status code."""
        method = method if "=" in method else f"ns=2;s={method}"
        answer = self.ask("call", object=f"ns=2;s={target}", method=method, inputs=inputs)
        return str(answer)

    def write(self, name: str, kind: str, value: Any) -> str:
        """Write a variable of the line. Return the name of the status code."""
        return str(self.ask("write", node=f"ns=2;s={name}", type=kind, value=value))

    def _read(self) -> None:
        for row in self._process.stdout or ():
            self._lines.put(row.strip())


@contextmanager
def node_session(address: str, folder: Path, user: str = "") -> Iterator[NodeSession]:
    """Yield a session of a user. folder: for the keys of the client."""
    command = ["node", str(CLIENT / "session.js"), address, str(folder), *([user, PASSWORD] if user else [])]
    home = {**os.environ, "HOME": str(folder), "XDG_CONFIG_HOME": str(folder)}
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT, text=True, env=home) as process:
        try:
            yield NodeSession(process)
            assert process.stdin is not None
            process.stdin.close()
            process.wait(PATIENCE)
        finally:
            process.kill()
