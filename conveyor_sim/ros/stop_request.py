"""Ctrl-C and SIGTERM as something to wait for."""

from __future__ import annotations

import signal
import socket


class StopRequest:
    """A signal, or a call of request(), whichever comes first. A signal interrupts nothing half done."""

    def __init__(self) -> None:
        """To be made in the main thread."""
        self._reader, self._writer = socket.socketpair()
        self._writer.setblocking(False)
        # Written to in C, whichever thread the signal meets: numpy's and DDS's threads would take a blocked one.
        signal.set_wakeup_fd(self._writer.fileno(), warn_on_full_buffer=False)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda _number, _frame: None)

    def request(self) -> None:
        """From any thread."""
        self._writer.send(b"\0")

    def wait(self) -> None:
        """Return once there was a request."""
        self._reader.recv(1)
