# SPDX-License-Identifier: Apache-2.0
"""`FaultyProxy`: a TCP proxy between a link and a PLC that damages, loses or delays the answers."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable
from contextlib import suppress

Fault = Callable[[bytes], "bytes | None"]
"""Returns the bytes that are passed on in place of an answer; None ends the connection."""


def healthy(data: bytes) -> bytes:
    return data


class FaultyProxy:
    """One that listens on a free port from its creation until `close`."""

    def __init__(self, port: int) -> None:
        """port: that of the PLC on this machine."""
        self.fault: Fault = healthy
        self._there = ("127.0.0.1", port)
        self._open: set[socket.socket] = set()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self) -> None:
        """End all connections."""
        self._listener.close()
        self.cut()

    def cut(self) -> None:
        """End all present connections."""
        for connection in list(self._open):
            _end(connection)

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._listener.accept()
            except OSError:
                return
            try:
                far = socket.create_connection(self._there)
            except OSError:
                near.close()
                continue
            self._open |= {near, far}
            for pair in ((near, far, False), (far, near, True)):
                threading.Thread(target=self._pass_on, args=pair, daemon=True).start()

    def _pass_on(self, source: socket.socket, sink: socket.socket, is_answer: bool) -> None:
        with suppress(OSError):
            while data := source.recv(65536):
                passed = self.fault(data) if is_answer else data
                if passed is None:
                    break
                sink.sendall(passed)
        for connection in (source, sink):
            _end(connection)
            self._open.discard(connection)


def _end(connection: socket.socket) -> None:
    with suppress(OSError):
        connection.shutdown(socket.SHUT_RDWR)
    connection.close()
