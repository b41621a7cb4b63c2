"""Processes of this package that cost no imports: each is forked from one that has made them already.

To import the package is more than half of what a short process costs. These are children of the process that asks,
with arguments, environment, folder, files and an end of their own, as if it had started Python for them. Only what is
read while modules are imported, such as NUMBA_CACHE_DIR, is that of the process that was there before: start those that
need another one with `subprocess`.
"""

from __future__ import annotations

import ctypes
import importlib
import json
import os
import runpy
import select
import signal
import socket
import subprocess
import sys
import tempfile
import types
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import IO, Any

from conveyor_sim.support.garbage import collected_later

LARGEST = 2**17  # bytes of a request
SUBREAPER = 36  # PR_SET_CHILD_SUBREAPER
# Nothing of ROS: threads start while it is imported, and what is forked from a process with threads does not end well.
IMPORTED = (
    "conveyor_sim.cli",
    "conveyor_sim.bag.replay",
    "conveyor_sim.control.load",
    "conveyor_sim.explain.choices",
    "conveyor_sim.live.stepper",
    "conveyor_sim.runs.compilation",
    "conveyor_sim.scada.bag_source",
    "conveyor_sim.scada.foxglove_server",
    "conveyor_sim.scada.modbus_server",
    "conveyor_sim.scada.mqtt.edge_node",
    "conveyor_sim.scada.opcua.server",
    "conveyor_sim.scada.scene_source",
    "conveyor_sim.scada.serving",
    "conveyor_sim.scada.web.server",
    "conveyor_sim.studies.runs",
    "dask.__main__",
    "distributed.cli.dask_scheduler",
    "distributed.cli.dask_worker",
)


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
        self.returncode: int | None = None
        request = {"arguments": [*arguments], "cwd": str(cwd or Path.cwd()), "env": {**(env or os.environ)}}
        self.pid = _ask(json.dumps(request).encode(), [stdout.fileno(), stderr.fileno()])
        self._end = os.pidfd_open(self.pid)

    def __del__(self) -> None:
        with suppress(AttributeError):
            os.close(self._end)

    def poll(self) -> int | None:
        """Its exit code; None while it runs."""
        return self._wait(0.0)

    def wait(self, timeout: float | None = None) -> int:
        """Its exit code. Raises subprocess.TimeoutExpired."""
        code = self._wait(timeout)
        if code is None:
            raise subprocess.TimeoutExpired(str(self.pid), timeout or 0.0)
        return code

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)

    def _wait(self, timeout: float | None) -> int | None:
        if self.returncode is None and select.select([self._end], [], [], timeout)[0]:
            self.returncode = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        return self.returncode


def run(arguments: Sequence[str], env: Mapping[str, str] | None = None, timeout: float = 120.0) -> Any:
    """One from its beginning to its end, as `subprocess.run` has it."""
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as errors:
        process = Warm(arguments, out, errors, env=env)
        try:
            code = process.wait(timeout)
        finally:
            process.kill()
        for file in (out, errors):
            file.seek(0)
        return subprocess.CompletedProcess(arguments, code, out.read(), errors.read())


def _ask(request: bytes, files: list[int]) -> int:
    """Have one forked; its process id."""
    control = _first()
    prctl = ctypes.CDLL(None).prctl
    prctl(SUBREAPER, 1, 0, 0, 0)  # whose parent ends meanwhile becomes a child of this process
    try:
        socket.send_fds(control, [request], files)
        pid, _ = control.recv(20), control.recv(20)
    finally:
        prctl(SUBREAPER, 0, 0, 0, 0)
    return int(pid)


@cache
def _first() -> socket.socket:
    """The process from which they are forked; it ends with this one, and interrupts what still runs then."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with theirs:
        subprocess.Popen(
            [sys.executable, __file__, str(theirs.fileno())],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},  # which it would start at once
            pass_fds=[theirs.fileno()],
            start_new_session=True,
        )
    return ours


def _fork_on_request(control: socket.socket) -> dict[str, Any] | None:
    """In each process that is forked, what it was asked for; in this one None, when nobody can ask any more."""
    running: list[int] = []
    while True:
        request, files, _, _ = socket.recv_fds(control, LARGEST, 2)
        if not request:
            for process in running:
                with suppress(ProcessLookupError):
                    signal.pidfd_send_signal(process, signal.SIGINT)
            return None
        read, write = os.pipe()
        between = os.fork()
        if not between:
            if os.fork():
                os._exit(0)
            os.setsid()
            os.write(write, str(os.getpid()).encode())
            for number, file in enumerate(files, start=1):
                os.dup2(file, number)
            for file in (*files, *running, read, write):
                os.close(file)
            control.close()
            return dict(json.loads(request))
        pid = int(os.read(read, 20))
        running.append(os.pidfd_open(pid))
        os.waitpid(between, 0)
        for file in (*files, read, write):
            os.close(file)
        control.send(str(pid).encode())
        control.send(b"has another parent")


def _become(request: Mapping[str, Any]) -> None:
    """What was asked for. It ends this process as it would end any Python, with all that it raises."""
    os.chdir(request["cwd"])
    os.environ.clear()
    os.environ.update(request["env"])
    option, what, *arguments = request["arguments"]
    sys.path[0] = ""
    sys.argv[:] = [option, *arguments]
    if option == "-m":
        runpy.run_module(what, run_name="__main__", alter_sys=True)
    else:
        main = sys.modules["__main__"] = types.ModuleType("__main__")
        exec(compile(what, "<string>", "exec"), main.__dict__)


if __name__ == "__main__":
    with collected_later():
        for name in IMPORTED:
            with suppress(ImportError):  # of what is not installed: its tests are skipped
                importlib.import_module(name)
    asked_for = _fork_on_request(socket.socket(fileno=int(sys.argv[1])))
    if asked_for is not None:
        _become(asked_for)
