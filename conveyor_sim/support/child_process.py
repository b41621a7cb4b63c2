"""A child process: its output goes to a log file; it ends when asked to, and with its parent at the latest."""

from __future__ import annotations

import errno
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

PATIENCE = 20.0  # s of wall time that a process has for an orderly end
LIFELINE = Path(__file__).with_name("lifeline.py")
TAIL = 15  # lines of a log shown when its process fails


def how_it_ended(code: int | None) -> str:
    """Return the words for an exit code of `subprocess`."""
    return f"was killed by signal {-code}" if code is not None and code < 0 else f"ended with exit code {code}"


class Process:
    """One process, from its start until stop()."""

    def __init__(self, name: str, command: Sequence[str], environment: Mapping[str, str], log_folder: Path) -> None:
        """Runs a command; its output goes to `<log_folder>/<name>.log`. Raises OSError if there is no such command.

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
                # A session of its own: Ctrl-C at the terminal reaches the parent alone, which ends its children.
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
        """Its process."""
        return self._process.pid

    @property
    def exit_code(self) -> int | None:
        """None while it runs."""
        return self._process.poll()

    def stop(self) -> None:
        """End it and what it has started, if it still runs, orderly if it lets itself be."""
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
        """The end of its log, indented."""
        lines = self.log.read_text(encoding="utf-8", errors="replace").splitlines()[-TAIL:]
        return "\n".join(f"  {line}" for line in lines or ["(empty)"])

    def obituary(self) -> str:
        """How it ended, and the end of its log."""
        return f"{self.name} {how_it_ended(self.exit_code)}; the end of its log:\n{self.last_words()}"
