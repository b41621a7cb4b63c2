# SPDX-License-Identifier: Apache-2.0
"""Child processes, which end with their parent at the latest, even if that is killed.

`start_python` runs a module of this package that talks over pipes, `Process` any command with a log file.
"""

from __future__ import annotations

import ctypes
import errno
import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from importlib import import_module
from multiprocessing.connection import Connection
from pathlib import Path

from conveyor_sim.support.garbage import collected_later

PATIENCE = 20.0  # s of wall time that a process has for an orderly end
LIFELINE = Path(__file__).with_name("lifeline.py")
TAIL = 15  # lines of a log shown when its process fails


CODE = "import sys; sys.path[:] = {path!r}; from conveyor_sim.support.child_process import run; run({module!r})"

_PR_SET_PDEATHSIG = 1  # linux/prctl.h


def start_python(
    module: str, *pipes: Connection, name: str = "", environment: Mapping[str, str] | None = None
) -> subprocess.Popen[bytes]:
    """Start a Python process that runs `main()` of a module and inherits `pipes`; the caller closes its copies.

    name: last argument of the process. environment: variables to add. The process leads a separate session: Ctrl-C
    at the terminal reaches only the parent, which ends its children in order.
    """
    numbers = [pipe.fileno() for pipe in pipes]
    arguments = [*map(str, numbers), *([name] if name else [])]
    return subprocess.Popen(
        [sys.executable, "-c", CODE.format(path=sys.path, module=module), *arguments],
        env={**os.environ, **(environment or {})},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        start_new_session=True,
        pass_fds=numbers,
    )


def run(module: str) -> None:
    """Run `main()` of a module, in the child. Its standard output goes to standard error."""
    os.dup2(2, 1)
    with collected_later():
        main = import_module(module).main
    main()


def pipes_of_child() -> list[Connection]:
    """Return the pipes that this process inherited, in the child."""
    return [Connection(int(argument)) for argument in sys.argv[1:] if argument.isdigit()]


def die_with_parent() -> None:
    """Make the kernel kill this process once the thread that started it has ended, even if this process is stopped.

    prctl(2), PR_SET_PDEATHSIG. If the parent died before this call, its pipes have ended. SIGINT is ignored.
    """
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def end_with(lifeline: Connection) -> None:
    """Kill this process, and the group that it leads, once the other end of a pipe is closed or its process ends."""
    threading.Thread(target=_kill_at_end, args=(lifeline,), daemon=True).start()


def _kill_at_end(lifeline: Connection) -> None:
    lifeline.poll(None)
    process = os.getpid()
    (os.killpg if process == os.getpgrp() else os.kill)(process, signal.SIGKILL)


def how_it_ended(code: int | None) -> str:
    """Return the words for an exit code of `subprocess`."""
    return f"was killed by signal {-code}" if code is not None and code < 0 else f"ended with exit code {code}"


class Process:
    """One process, from its start until stop()."""

    def __init__(self, name: str, command: Sequence[str], environment: Mapping[str, str], log_folder: Path) -> None:
        """Run a command; its output goes to `<log_folder>/<name>.log`. Raises OSError if there is no such command.

        When this process ends, even by SIGKILL, the command is interrupted as by stop().
        """
        if shutil.which(command[0], path=environment.get("PATH")) is None:
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), command[0])
        self.name = name
        self.log = log_folder / f"{name}.log"
        watched, lifeline = os.pipe()
        self._lifeline: int | None = lifeline
        lead = [sys.executable, "-I", "-S", str(LIFELINE), str(watched), str(PATIENCE)]
        try:
            with self.log.open("wb") as output:
                # A separate session: Ctrl-C at the terminal reaches only the parent, which ends its children.
                self._process = subprocess.Popen(
                    [*lead, *command],
                    env=dict(environment),
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                    pass_fds=[watched],
                )
        except BaseException:
            os.close(lifeline)
            raise
        finally:
            os.close(watched)

    @property
    def pid(self) -> int:
        """ID of the process."""
        return self._process.pid

    @property
    def exit_code(self) -> int | None:
        """Exit code; None while it runs."""
        return self._process.poll()

    def stop(self) -> None:
        """End the command and its children, if it still runs: by SIGINT, and by SIGKILL after PATIENCE."""
        if self.exit_code is None:
            os.killpg(self.pid, signal.SIGINT)
            try:
                self._process.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                os.killpg(self.pid, signal.SIGKILL)
                self._process.wait()
        if self._lifeline is not None:
            os.close(self._lifeline)
            self._lifeline = None

    def last_words(self) -> str:
        """Return the end of its log, indented."""
        lines = self.log.read_text(encoding="utf-8", errors="replace").splitlines()[-TAIL:]
        return "\n".join(f"  {line}" for line in lines or ["(empty)"])

    def obituary(self) -> str:
        """Return how it ended, and the end of its log."""
        return f"{self.name} {how_it_ended(self.exit_code)}; the end of its log:\n{self.last_words()}"
