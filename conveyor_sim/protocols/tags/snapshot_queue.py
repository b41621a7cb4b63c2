# SPDX-License-Identifier: Apache-2.0
"""`SnapshotQueue`: snapshots of a line that wait for the asyncio loop of a protocol server."""

from __future__ import annotations

import asyncio
from collections import deque
from contextlib import suppress
from datetime import datetime, timezone

from conveyor_sim.protocols.tags.tag_provider import LineSnapshot, TagProvider

MOST_BEHIND = 200
"""Largest number of ticks that wait for the loop; a further one replaces the newest."""


class SnapshotQueue:
    """Snapshots of one tag provider with the wall times at which they arrived, and the event that wakes the loop."""

    def __init__(self, source: TagProvider) -> None:
        """Start empty. `open` must follow in the loop."""
        self._source = source
        self.waiting: deque[tuple[LineSnapshot, datetime]] = deque()
        """Snapshots with their wall times, the oldest first."""
        self._is_woken = False
        self.left_out = 0
        """Ticks so far that were replaced while they waited."""
        self._longest = 0.0

    def open(self) -> None:
        """Wake the running loop from now on."""
        self._loop, self.wake = asyncio.get_running_loop(), asyncio.Event()

    async def wait(self) -> None:
        """Wait until the loop is woken."""
        await self.wake.wait()
        self.wake.clear()
        self._is_woken = False

    async def done(self, heard: datetime) -> None:
        """Note that the snapshot of a wall time was sent, and let other tasks run."""
        self._longest = max(self._longest, (datetime.now(timezone.utc) - heard).total_seconds())
        await asyncio.sleep(0)

    def take_longest(self) -> float:
        """Return the longest wall time from a change of the tags to the end of its sending since the last call, s."""
        longest, self._longest = self._longest, 0.0
        return longest

    def hear(self) -> None:
        """Queue the present snapshot. May be called by any thread."""
        if len(self.waiting) >= MOST_BEHIND:
            with suppress(IndexError):
                self.waiting.pop()
                self.left_out += 1
        self.waiting.append((self._source.snapshot, datetime.now(timezone.utc)))
        self.notice()

    def notice(self) -> None:
        """Wake the loop. May be called by any thread."""
        if not self._is_woken:
            self._is_woken = True
            with suppress(RuntimeError):  # the loop is closed
                self._loop.call_soon_threadsafe(self.wake.set)
