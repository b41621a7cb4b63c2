# SPDX-License-Identifier: Apache-2.0
"""A server on this machine for a page and its data."""

# This is the standard library's server. aiohttp, which serves the page of a running line (`protocols/web`), lacks a
# quick start: its import takes 0.22 s of a core, and `conveyor-sim view` answers after 0.95 s of a core in all.

from __future__ import annotations

import socket
import sys
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import urlsplit

from conveyor_sim.errors import ConveyorError
from conveyor_sim.page.bundle import HEADERS, PAGE, page_files
from conveyor_sim.page.own_host import is_own
from conveyor_sim.support.printable import SENTENCE, printable

ADDRESS = "127.0.0.1"
MOST_CONNECTIONS = 64
"""Connections at a time; the oldest one is closed for one more."""
SILENT = 20.0
"""Wall time in which a browser must send a request, and receive the answer, s."""


class PageHost(AbstractContextManager["PageHost"]):
    """Server of the page's files and of data by name; it serves until it is closed."""

    def __init__(self, answer: Callable[[str], bytes], port: int = 0, first: str = "index.html") -> None:
        """answer: returns the deflated part of the data with a name, and raises KeyError if there is none.

        port: 0 for any free port. first: file of the page at the address without a path. Raise ConveyorError if the
        port is taken.
        """
        try:
            self._server = _Server((ADDRESS, port), PageHandler)
        except OSError as error:
            raise ConveyorError(
                f"--port: {port} given, expected one that is free ({error.strerror or error})"
            ) from error
        self._server.answer, self._server.first = answer, first
        self._thread = threading.Thread(target=self._server.serve_forever, name="page", daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{ADDRESS}:{self._server.server_address[1]}/"

    def __exit__(self, *_: object) -> None:
        """Stop the server."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    request_queue_size = 128
    """Connections that may wait to be accepted. A browser repeats one that is dropped only after a second."""
    answer: Callable[[str], bytes]
    first: str

    def __init__(self, *arguments: Any) -> None:
        self._connected: dict[Any, None] = {}
        self._changing = threading.Lock()
        super().__init__(*arguments)

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer the request in a new thread."""
        with self._changing:
            if len(self._connected) >= MOST_CONNECTIONS:
                oldest = next(iter(self._connected))
                del self._connected[oldest]
                with suppress(OSError):  # the connection has just ended
                    oldest.shutdown(socket.SHUT_RDWR)
            self._connected[request] = None
        super().process_request(request, client_address)

    def shutdown_request(self, request: Any) -> None:
        """Forget a connection that has ended."""
        with self._changing:
            self._connected.pop(request, None)
        super().shutdown_request(request)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore browsers that disconnect during an answer."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)


class PageHandler(BaseHTTPRequestHandler):
    """Answers of a server of the page."""

    server: _Server
    server_version, sys_version = "conveyor_sim", ""
    timeout = SILENT

    def do_GET(self) -> None:
        """Answer a request for a file of the page, or for a part of its data."""
        path = urlsplit(self.path).path.removeprefix("/") or self.server.first
        if not is_own(self.headers.get_all("Host", []), "http"):
            self._send(HTTPStatus.FORBIDDEN, b"expected a request for the host 127.0.0.1", "text/plain")
        elif path.startswith("data/"):
            self._send_part(path.removeprefix("data/"))
        elif (kind := page_files().get(path)) is not None:
            self._send(HTTPStatus.OK, (PAGE / path).read_bytes(), kind)
        else:
            self._send(HTTPStatus.NOT_FOUND, b"there is no such file", "text/plain")

    def _send_part(self, name: str) -> None:
        try:
            self._send(HTTPStatus.OK, self.server.answer(name), "application/octet-stream")
        except KeyError:
            self._send(HTTPStatus.NOT_FOUND, b"there is no such part", "text/plain")
        except ConveyorError as error:
            reason = printable(error, SENTENCE).encode()
            self._send(HTTPStatus.INTERNAL_SERVER_ERROR, reason, "text/plain")

    def _send(self, status: HTTPStatus, content: bytes, kind: str) -> None:
        self.send_response(status)
        self.send_header("Content-Type", f"{kind}; charset=utf-8" if kind.startswith("text/") else kind)
        self.send_header("Content-Length", str(len(content)))
        for name, value in HEADERS.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing. The page shows parts that can't be read."""
