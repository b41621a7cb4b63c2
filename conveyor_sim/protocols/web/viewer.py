"""`Viewer`: connection of one page, with the messages that wait for it."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import Any

from aiohttp import web

UNSEEN = 2
"""Largest number of frames in transit to a page. The page acknowledges each frame, and gets no more before that."""

MOST_WAITING = 2_000_000
"""Largest number of bytes that wait for a page. Beyond it they are dropped, and the page begins anew."""


class Viewer:
    """Connection of one page. Frames are dropped while it is busy."""

    def __init__(self, socket: web.WebSocketResponse) -> None:
        """Prepare the connection; `send` must run to send messages."""
        self._socket = socket
        self._waiting: deque[bytes] = deque()
        self._bytes = 0
        self._frame: bytes | None = None
        self._unseen = 0
        self._sending = False
        self._news = asyncio.Event()
        self.began = False
        """True if the page has received the message `begin`."""
        self.lagging = False
        """True if messages were dropped that the page needs."""
        self.seen: Any = None
        """Key of the last frame that was sent."""
        self.on_ready: Callable[[], object] = lambda: None
        """Function to call when the page is ready for a frame."""

    @property
    def ready(self) -> bool:
        """True if the page is ready for a frame."""
        return self._frame is None and self._unseen < UNSEEN

    @property
    def waiting(self) -> int:
        """Number of bytes that wait, frames excluded."""
        return self._bytes

    @property
    def free(self) -> bool:
        """True if no message waits or is being sent."""
        return not (self._waiting or self._sending)

    def begin(self, message: bytes) -> None:
        """Send a message that replaces everything that waits."""
        self._waiting.clear()
        self._bytes, self.lagging = 0, False
        if self._frame is not None:
            self._frame, self._unseen = None, self._unseen - 1
        self.tell(message)

    def tell(self, message: bytes) -> None:
        """Queue a message."""
        if self._waiting and self._bytes + len(message) > MOST_WAITING:
            self._waiting.clear()
            self._bytes, self.lagging = 0, True
            return
        self._waiting.append(message)
        self._bytes += len(message)
        self._news.set()

    def show(self, frame: bytes) -> None:
        """Send a frame after the queued messages."""
        self._frame = frame
        self._unseen += 1
        self._news.set()

    def saw(self) -> None:
        """Note that the page has shown a frame."""
        self._unseen = max(0, self._unseen - 1)
        self.on_ready()

    async def send(self) -> None:
        """Send queued messages and frames until the connection ends."""
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
