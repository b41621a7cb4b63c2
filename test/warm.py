# SPDX-License-Identifier: Apache-2.0
"""Processes of this package that cost no imports: each is forked from one that has made them already.

To import the package is more than half of what a short process costs. Only what is read while modules are imported,
such as NUMBA_CACHE_DIR, is that of the process that was there before: start those that need another with `subprocess`.
"""

from __future__ import annotations

import atexit
import multiprocessing
import os
import runpy
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Mapping, Sequence
from multiprocessing.reduction import DupFd
from pathlib import Path
from typing import IO, Any

FORKED = multiprocessing.get_context("forkserver")
# Nothing of ROS: threads start while it is imported, and what is forked from a process with threads does not end well.
# What is not installed is left out, and its tests are skipped.
FORKED.set_forkserver_preload([
    "conveyor_sim.cli",
    "conveyor_sim.bag.replay",
    "conveyor_sim.control.load",
    "conveyor_sim.report.explain.choices",
    "conveyor_sim.run.stepper",
    "conveyor_sim.run.compilation",
    "conveyor_sim.protocols.tags.bag_provider",
    "conveyor_sim.protocols.foxglove.server",
    "conveyor_sim.protocols.modbus.server",
    "conveyor_sim.protocols.mqtt.edge_node",
    "conveyor_sim.protocols.opcua.server",
    "conveyor_sim.protocols.tags.scene_provider",
    "conveyor_sim.protocols.hosting.serving",
    "conveyor_sim.protocols.web.server",
])  # fmt: skip


class Warm:
    """One of them, with as much of `subprocess.Popen` as the tests need."""

    def __init__(
        self,
        arguments: Sequence[str],
        stdout: IO[Any],
        stderr: IO[Any],
        cwd: Path | None = None,
        env: Mapping[str, str] | None = None,
    ) -> None:
        """`python <arguments>`, which begin with -m or -c; it reads nothing, and has a session of its own."""
        given = [*arguments], stdout, stderr, cwd or Path.cwd(), {**(env or os.environ)}
        self._process = FORKED.Process(target=_Become(*given))
        self._process.start()
        self.pid: int = self._process.pid or 0

    @property
    def returncode(self) -> int | None:
        return self._process.exitcode

    def poll(self) -> int | None:
        """Its exit code; None while it runs."""
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Its exit code. Raises subprocess.TimeoutExpired."""
        self._process.join(timeout)
        if self.returncode is None:
            raise subprocess.TimeoutExpired(str(self.pid), timeout or 0.0)
        return self.returncode

    def send_signal(self, number: int) -> None:
        if self.returncode is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        self._process.kill()


def run(
    arguments: Sequence[str], env: Mapping[str, str] | None = None, timeout: float = 120.0, cwd: Path | None = None
) -> Any:
    """One from its beginning to its end, as `subprocess.run` has it."""
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as errors:
        process = Warm(arguments, out, errors, cwd, env)
        try:
            code = process.wait(timeout)
        finally:
            process.kill()
        for file in (out, errors):
            file.seek(0)
        return subprocess.CompletedProcess(arguments, code, out.read(), errors.read())


class _Become:
    """What such a process does."""

    def __init__(self, arguments: list[str], out: IO[Any], errors: IO[Any], cwd: Path, env: dict[str, str]) -> None:
        self._given = arguments, cwd, env
        self._files = out, errors

    def __getstate__(self) -> Any:
        return self._given, [DupFd(file.fileno()) for file in self._files]

    def __setstate__(self, state: Any) -> None:
        self._given, self._files = state

    def __call__(self) -> None:
        option, what, *arguments = self._given[0]
        os.setsid()
        for number, file in enumerate(self._files, start=1):
            os.dup2(file.detach(), number)
        threading.Thread(target=_end_with_parent, daemon=True).start()
        os.chdir(self._given[1])
        os.environ.clear()
        os.environ.update(self._given[2])
        sys.path[0] = ""
        sys.argv[:] = [option, *arguments]
        try:
            if option == "-m":
                runpy.run_module(what, run_name="__main__", alter_sys=True)
            else:
                exec(compile(what, "<string>", "exec"), {"__name__": "__main__"})
        finally:
            atexit._run_exitfuncs()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os.kill(os.getpid(), signal.SIGINT)
