"""Child processes of a process that serves a line: the one that simulates, and one for each protocol server."""

from __future__ import annotations

import ctypes
import signal
import subprocess
import sys
from multiprocessing.connection import Connection

CODE = "import sys; sys.path[:] = {path!r}; from {module} import main; main()"

_PR_SET_PDEATHSIG = 1  # linux/prctl.h


def start_child(module: str, *pipes: Connection, name: str = "") -> subprocess.Popen[bytes]:
    """Start a Python process that runs `main()` of a module. It inherits `pipes`; its arguments are their descriptors.

    name: last argument, by which people recognise the process. It runs in a new session: a Ctrl-C at the terminal must
    reach the parent only, which ends its children in order.
    """
    numbers = [pipe.fileno() for pipe in pipes]
    arguments = [*map(str, numbers), *([name] if name else [])]
    return subprocess.Popen(
        [sys.executable, "-c", CODE.format(path=sys.path, module=module), *arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        start_new_session=True,
        pass_fds=numbers,
    )


def pipes_of_child() -> list[Connection]:
    """Return the pipes that this process was started with, as the child."""
    return [Connection(int(argument)) for argument in sys.argv[1:] if argument.isdigit()]


def die_with_parent() -> None:
    """Make the kernel kill this process once the thread that started it has ended, even if this process is stopped.

    prctl(2), PR_SET_PDEATHSIG. A parent that died before this call is noticed by the end of the pipes.
    """
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
