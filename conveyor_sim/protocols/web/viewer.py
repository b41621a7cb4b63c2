"""`Viewer`: a page that looks at a line, and what waits to be sent to it."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import Any

from aiohttp import web

UNSEEN = 2
"""Frames on their way to a page, at most: it says which it has shown, and gets no others before."""

MOST_WAITING = 2_000_000
"""Bytes that wait for a page, at most; of one that takes them too slowly they are forgotten, and it begins anew."""


class Viewer:
    """Of one connection. Nobody waits for it: frames that it has no time for are left out."""

    def __init__(self, socket: web.WebSocketResponse) -> None:
        """It is told nothing before `send` runs."""
        self._socket = socket
        self._waiting: deque[bytes] = deque()
        self._bytes = 0
        self._frame: bytes | None = None
        self._unseen = 0
        self._sending = False
        self._news = asyncio.Event()
        self.began = False
        """Whether it has been told what it looks at."""
        self.lagging = False
        """Whether something that it should know was forgotten."""
        self.seen: Any = None
        """What it was shown last."""
        self.on_ready: Callable[[], object] = lambda: None
        """Called when it has time for a frame."""

    @property
    def ready(self) -> bool:
        """Whether it has time for a frame."""
        return self._frame is None and self._unseen < UNSEEN

    @property
    def waiting(self) -> int:
        """Bytes that wait for it, but for a frame."""
        return self._bytes

    @property
    def free(self) -> bool:
        """Whether nothing waits for it."""
        return not (self._waiting or self._sending)

    def begin(self, message: bytes) -> None:
        """Send this before all else; what waits is as good as said."""
        self._waiting.clear()
        self._bytes, self.lagging = 0, False
        if self._frame is not None:
            self._frame, self._unseen = None, self._unseen - 1
        self.tell(message)

    def tell(self, message: bytes) -> None:
        """Send this, too."""
        if self._waiting and self._bytes + len(message) > MOST_WAITING:
            self._waiting.clear()
            self._bytes, self.lagging = 0, True
            return
        self._waiting.append(message)
        self._bytes += len(message)
        self._news.set()

    def show(self, frame: bytes) -> None:
        """Send this, behind what it is told."""
        self._frame = frame
        self._unseen += 1
        self._news.set()

    def saw(self) -> None:
        """It has shown a frame."""
        self._unseen = max(0, self._unseen - 1)
        self.on_ready()

    async def send(self) -> None:
        """Until the connection ends."""
        while True:
            await self._news.wait()
            self._news.clear()
            while self._waiting:
                message = self._waiting.popleft()
                self._bytes -= len(message)
                await self._pass_on(message)
            frame, self._frame = self._frame, None
            if frame is not None:
                await self._pass_on(frame)
            self.on_ready()

    async def _pass_on(self, message: bytes) -> None:
        self._sending = True
        await self._socket.send_bytes(message)
        self._sending = False
