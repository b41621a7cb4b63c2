"""A server on this machine for the page of a recording of any length. Each request is read by the recording's index."""

# This is the standard library's server. aiohttp, which serves the page of a running line (`protocols/web`), lacks a
# quick start: its import takes 0.22 s of a core, and `conveyor-sim view` answers after 0.95 s of a core in all.

from __future__ import annotations

import socket
import sys
import threading
import zlib
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.errors import ConveyorError
from conveyor_sim.page.bundle import HEADERS, PAGE, page_files
from conveyor_sim.page.difference import RecordingComparison
from conveyor_sim.page.own_host import is_own
from conveyor_sim.page.recording import Detail, PageRecording, text
from conveyor_sim.support.printable import SENTENCE, printable

ADDRESS = "127.0.0.1"
MOST_CONNECTIONS = 64
"""Connections at a time; the oldest one is closed for one more."""
SILENT = 20.0
"""Wall time in which a browser must send a request, and receive the answer, s."""
SERVED = Detail(bottles=50.0, contacts=25.0, belts=50.0, signals=50.0, block=2.0, story=60.0)


class RecordingServer(AbstractContextManager["RecordingServer"]):
    """Server of a bag's page; it serves until it is closed."""

    def __init__(self, path: Path, port: int = 0, other: Path | None = None) -> None:
        """port: 0 for any free port. other: a recording that is shown beside it, at the same times.

        Raise BagError, SceneError, and ConveyorError if the port is taken, or the recordings can't be compared.
        """
        with ExitStack() as stack:
            bags = [path] if other is None else [path, other]
            # Blocks on display and the story are read in parallel, each by its own reader.
            for_blocks, for_stories = (
                [stack.enter_context(open_bag(bag, by_index=True)) for bag in bags] for _ in range(2)
            )
            self._blocks = [PageRecording(bag, SERVED) for bag in for_blocks]
            self._stories = [PageRecording(bag, SERVED) for bag in for_stories]
            a, *b = for_stories
            self._comparison = RecordingComparison(a, b[0], SERVED.story) if b else None
            self._block_lock, self._story_lock = threading.Lock(), threading.Lock()
            try:
                self._server = _Server((ADDRESS, port), _Handler)
            except OSError as error:
                raise ConveyorError(
                    f"--port: {port} given, expected one that is free ({error.strerror or error})"
                ) from error
            self._server.answer = self.answer
            stack.callback(self._server.server_close)
            self._thread = threading.Thread(target=self._server.serve_forever, name="page", daemon=True)
            self._thread.start()
            stack.callback(self._server.shutdown)
            self._stack = stack.pop_all()

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{ADDRESS}:{self._server.server_address[1]}/"

    def answer(self, name: str) -> bytes:
        """Return the deflated part with a name. Raise KeyError if there is none, and BagError.

        Names: head, story/<n>, block/<n>, each of them after other/ for the other recording, and difference/<n>.
        """
        place = int(name.startswith("other/"))
        if place >= len(self._blocks):
            raise KeyError(name)
        kind, _, number = name.removeprefix("other/").partition("/")
        blocks, stories, comparison = self._blocks[place], self._stories[place], self._comparison
        if kind == "head" and not number:
            compared = {"compared": comparison.head()} if comparison is not None and not place else {}
            return self._deflated(self._block_lock, lambda: text({**blocks.head(), **compared}))
        counts = {"story": stories.stories, "block": blocks.blocks}
        if comparison is not None and not place:
            counts["difference"] = comparison.stretches
        if kind not in counts or not (number.isdecimal() and len(number) < 10) or int(number) >= counts[kind]:
            raise KeyError(name)
        if kind == "block":
            return self._deflated(self._block_lock, lambda: blocks.block(int(number)))
        if kind == "difference" and comparison is not None:
            return self._deflated(self._story_lock, lambda: text(comparison.part(int(number))))
        return self._deflated(self._story_lock, lambda: stories.story(int(number)))

    def __exit__(self, *_: object) -> None:
        """Stop the server."""
        self._stack.close()
        self._thread.join()

    def _deflated(self, lock: threading.Lock, make: Callable[[], bytes]) -> bytes:
        with lock:
            part = make()
        return zlib.compress(part, 1)


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    request_queue_size = 128
    """Connections that may wait to be accepted. A browser repeats one that is dropped only after a second."""
    answer: Callable[[str], bytes]

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


class _Handler(BaseHTTPRequestHandler):
    server: _Server
    server_version, sys_version = "conveyor_sim", ""
    timeout = SILENT

    def do_GET(self) -> None:
        path = urlsplit(self.path).path.removeprefix("/") or "index.html"
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
            self._send(HTTPStatus.NOT_FOUND, b"there is no such part of the recording", "text/plain")
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
