# SPDX-License-Identifier: Apache-2.0
"""Start of a command that ends with the process that started it. `child_process.Process` runs it as follows.

    python -I -S lifeline.py DESCRIPTOR PATIENCE COMMAND...

The process becomes the command, as the leader of a separate session. A watcher stays behind in the command's process
group. Only the parent holds the other end of the pipe DESCRIPTOR. When that is closed, by the parent or by its death,
the watcher interrupts the group as Ctrl-C would, so that a recording is completed. It kills the rest of the group after
PATIENCE seconds. When the command ends, the watcher ends the rest of the group as well. The kernel's own signal at the
parent's death depends on the thread that started the command, and reaches none of the command's children.

A separate program that imports only the standard library starts in 20 ms, before any part of ROS is loaded.
"""

from __future__ import annotations

import os
import select
import signal
import sys
import time

LOOK = 0.2  # wall time between two checks of the command, s


def watch(lifeline: int, patience: float, leader: int) -> None:
    """Outlive the leader of this process's group, and end what is left of the group."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    while runs(leader) and not select.select([lifeline], [], [], LOOK)[0]:
        pass
    os.killpg(0, signal.SIGINT)
    end = time.monotonic() + patience
    while runs(leader):
        if time.monotonic() > end:
            os.killpg(0, signal.SIGKILL)  # this process too
        time.sleep(LOOK)
    os.killpg(0, signal.SIGTERM)


def runs(leader: int) -> bool:
    """Return True if the leader of this process's group runs. Its ID is not reused while the group has members."""
    try:
        os.kill(leader, 0)
    except ProcessLookupError:
        return False
    return True


def main() -> None:
    """Become the command. This never returns."""
    lifeline, patience, command = int(sys.argv[1]), float(sys.argv[2]), sys.argv[3:]
    for number in (signal.SIGINT, signal.SIGPIPE, signal.SIGXFSZ):  # which Python handles or ignores
        signal.signal(number, signal.SIG_DFL)
    leader = os.getpid()
    helper = os.fork()
    if helper == 0:
        # Forked twice: the command must not find a child that it has not started.
        if os.fork() == 0:
            null = os.open(os.devnull, os.O_RDWR)
            for output in (0, 1, 2):
                os.dup2(null, output)
            watch(lifeline, patience, leader)
        os._exit(0)
    os.waitpid(helper, 0)
    os.close(lifeline)
    try:
        os.execvp(command[0], command)
    except OSError as error:
        print(f"{command[0]}: {error.strerror}", file=sys.stderr)
        os._exit(127)


if __name__ == "__main__":
    main()
