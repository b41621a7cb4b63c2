# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C, SIGTERM and a closed terminal as a request that a thread waits for.

A KeyboardInterrupt would be lost wherever Python ignores exceptions.
"""

from __future__ import annotations

import select
import signal
import socket
from contextlib import AbstractContextManager

from conveyor_sim.support.signals import HandledOnce

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class StopRequest(AbstractContextManager["StopRequest"]):
    """Request to stop, by a signal or a call of request(). No operation is interrupted.

    A second signal ends the process even if it hangs. For the main thread. At the end of the context the previous
    handlers are restored.
    """

    def __init__(self) -> None:
        self._reader, self._writer = socket.socketpair()
        self._writer.setblocking(False)
        # The C handler writes to this socket in the thread that gets the signal. `wait` in the main thread then
        # returns, even if a thread of numpy or DDS got the signal.
        self._wakeup_before = signal.set_wakeup_fd(self._writer.fileno(), warn_on_full_buffer=False)
        self._signals = HandledOnce(SIGNALS, lambda _number, _frame: None)

    @property
    def requested(self) -> bool:
        """True if there was a request."""
        return self.wait(0.0)

    def request(self) -> None:
        """Request the stop. May be called by any thread."""
        self._writer.send(b"\0")

    def wait(self, seconds: float | None = None) -> bool:
        """Wait up to `seconds` of wall time (None: for ever) for a request. Return True if one came."""
        return bool(select.select([self._reader], [], [], seconds)[0])

    def __exit__(self, *_: object) -> None:
        self._signals.__exit__()
        signal.set_wakeup_fd(self._wakeup_before)
        self._reader.close()
        self._writer.close()
