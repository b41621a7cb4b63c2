# SPDX-License-Identifier: Apache-2.0
"""`Feed`: messages to the pages that show a line, made once for all pages.

Messages are bytes. The first byte is the type. TEXT: a JSON object, whose "kind" is begin, story, status, locked, reply
or pong. FRAME: a tick (float64), its wall time in s since 1970 (float64), both little-endian, and a block of
`page.block.pack` that begins at the tick and holds that moment. page/page/live.js reads them.
"""

from __future__ import annotations

import asyncio
import struct
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

from aiohttp import web

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.columns.events import Event, event_columns
from conveyor_sim.page.block import BlockContent, block_ticks, pack
from conveyor_sim.page.head import head
from conveyor_sim.page.recording import text
from conveyor_sim.page.story import Story
from conveyor_sim.protocols.tags.line_mirror import DrawableFrame, DrawableProvider
from conveyor_sim.protocols.tags.tag_provider import LineSnapshot
from conveyor_sim.scene import parse_again, parse_overrides
from conveyor_sim.support.printable import SENTENCE, printable

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


COUNTERS = 0.5
"""Shortest simulated time between two entries of the counters, s."""


class LineStory(Story):
    """Story of one run from a moment on. It starts with the complete state at that moment."""

    def __init__(self, tick_ns: int) -> None:
        super().__init__(lambda tick: tick * tick_ns * 1e-9, COUNTERS)
        self._seen: dict[str, Any] = {}

    def look(self, snapshot: LineSnapshot, drawable: DrawableFrame, events: Sequence[Event]) -> None:
        """Add events, and what has changed since the last call."""
        latest: dict[str, Any] = {"alarm_states": snapshot.alarms, "readback": snapshot.read_back}
        latest |= {topic: drawable.drawn.get(topic) for topic in ("counters", "rail_wear")}
        new = {topic: what for topic, what in latest.items() if what is not None and what is not self._seen.get(topic)}
        self._seen |= new
        if (columns := event_columns(events, len(events))) is not None:
            self.add("events", columns, snapshot.tick)
        for topic, what in new.items():
            if callable(what):
                what = what()
                self.add(topic, what, int(what.tick))
            else:
                self.add(topic, what, snapshot.tick)

    def _readback(self, message: Any, time: float) -> None:
        """Add the commands with the ticks of their last changes, which may be before the first call."""
        before = len(self.data["readback"])
        super()._readback(message, time)
        rows = self.data["readback"][before:]
        for row in rows:
            row[0] = self._time(int(message.since[row[1]]))
        self.data["readback"][before:] = sorted(rows, key=lambda row: float(row[0]))


TEXT, FRAME = 0, 1

SHORTEST = 0.02
"""Shortest wall time between two frames, s."""

STORY = 0.1
"""Shortest wall time between two messages of events, s."""

BLOCK = 2.0
"""Length of the blocks in which a page stores the data that it received, s."""

MOST_PAST_EVENTS = 2000
"""Largest number of past events that a newly opened page receives."""


class Feed:
    """Feed of one tag provider, active while a page is open."""

    def __init__(self, source: DrawableProvider, **about: Any) -> None:
        """Prepare the feed. about: more fields of the message `begin`."""
        self._source, self._about = source, about
        self._viewers: set[Viewer] = set()
        self._changed = asyncio.Event()
        self._ends: list[Any] = []
        self._task: asyncio.Task[None] | None = None
        self._drawable, self._snapshot = source.frame, source.snapshot
        self._story = self._new_story()
        self._sent_at = 0.0
        self._due = False  # True if a message of events is scheduled
        self._heard = 0
        self._status: dict[str, Any] = {}
        self._frame: tuple[Any, bytes] = None, b""
        self._head: tuple[Any, dict[str, Any]] = None, {}
        self._failure = ""
        self.longest = 0.0
        """Longest wall time from a tick to the sending of its frame, s, since the last reset by the reader."""

    @property
    def viewers(self) -> int:
        """Number of open pages."""
        return len(self._viewers)

    def join(self, viewer: Viewer) -> None:
        """Send the line to a page from now on."""
        if self._task is None:
            loop = asyncio.get_running_loop()

            def heard() -> None:
                with suppress(RuntimeError):  # the loop has ended
                    loop.call_soon_threadsafe(self._changed.set)

            self._ends = [self._source.watch(), self._source.listen(heard)]
            self._drawable, self._snapshot = self._source.frame, self._source.snapshot
            self._story, (self._heard, _) = self._new_story(), self._source.events(0)
            self._status = {}
            self._task = asyncio.create_task(self._run())
        self._viewers.add(viewer)
        viewer.began = False
        viewer.on_ready = self._changed.set
        self._changed.set()

    def leave(self, viewer: Viewer) -> None:
        """Stop sending to a page."""
        self._viewers.discard(viewer)
        if not self._viewers:
            self.close()

    def close(self) -> None:
        """Stop following the line."""
        if self._task is not None:
            self._task.cancel()
            self._task = None
        for end in self._ends:
            end()
        self._ends = []

    async def _run(self) -> None:
        while True:
            await self._changed.wait()
            self._changed.clear()
            try:
                line = self._source.frame.line
                if self._head[0] is not line:  # a thread, because importing the reader of an underlay takes a second
                    self._head = line, await asyncio.to_thread(_head_of, line)
                self._follow()
                self._failure = ""
            except Exception as error:  # messages of a damaged recording or another version may have any content
                self._failure = printable(f"it can't be drawn: {error}", SENTENCE)
            await asyncio.sleep(SHORTEST)

    def _follow(self) -> None:
        before, self._drawable, self._snapshot = self._snapshot, self._source.frame, self._source.snapshot
        present = self._snapshot
        if present.run_id != before.run_id or present.tick < before.tick:  # another run, or a step back in time
            self._story, (self._heard, _) = self._new_story(), self._source.events(0)
            for viewer in self._viewers:
                viewer.began = False
        self._look()
        now, new = time.monotonic(), [one for one in self._viewers if not one.began or (one.lagging and one.free)]
        if new or now > self._sent_at + STORY:  # a new page's first message includes earlier events
            self._sent_at = now
            self._send_all()
        elif not self._due:
            self._due = True
            asyncio.get_running_loop().call_later(STORY, self._send_later)
        for viewer in new:
            self._begin(viewer)
        for viewer in self._viewers:
            if viewer.ready and not viewer.lagging and viewer.seen != (key := self._key()):
                viewer.seen = key
                viewer.show(self._frame_of(key))
                self.longest = max(self.longest, time.time() - self._drawable.at)

    def _begin(self, viewer: Viewer) -> None:
        """Send the complete present state of the line to a page."""
        drawable, line = self._drawable, self._drawable.line
        if self._head[0] is not line:  # the line has changed since it was looked at
            self._head = line, _head_of(line)
        times = {
            "first": drawable.tick,
            "last": drawable.tick,
            "block": block_ticks(int(line.tick_ns), BLOCK),
            "blocks": 1,
            "stories": 1,
        }
        about = {**self._head[1], "times": times, "forced": drawable.forced.tolist(), "faults": drawable.faults}
        story = self._new_story()
        total, events = self._source.events(max(0, self._heard - MOST_PAST_EVENTS))
        story.look(
            self._snapshot, drawable, events[: len(events) - (total - self._heard)]
        )  # later events follow in messages
        viewer.begin(text_message("begin", head=about, story=story.take(), status=self._status_now(), **self._about))
        viewer.began, viewer.seen = True, None

    def _send_later(self) -> None:
        """Send pending events even if there is no new tick."""
        self._due = False
        self._changed.set()

    def _look(self) -> None:
        """Collect new events with their ticks."""
        self._heard, events = self._source.events(self._heard)
        self._story.look(self._snapshot, self._drawable, events)

    def _send_all(self) -> None:
        """Send new events and status to the pages that have begun."""
        self._look()
        data = self._story.take()
        is_new = data["events"]["at"] or any(what for name, what in data.items() if name != "events")
        messages = [text_message("story", **data)] if is_new else []
        status = self._status_now()
        if status != self._status:
            self._status = status
            messages.append(text_message("status", status=status))
        for viewer in self._viewers:
            if viewer.began:
                for message in messages:
                    viewer.tell(message)

    def _status_now(self) -> dict[str, Any]:
        snapshot = self._snapshot
        return {
            "lost": snapshot.lost or self._failure,
            "run": snapshot.run.text,
            "reason": snapshot.run.reason,
            "owner": snapshot.owner,
            "viewers": len(self._viewers),
            "servers": [{**health._asdict(), "text": health.text} for health in self._source.servers],
        }

    def _new_story(self) -> LineStory:
        return LineStory(int(self._drawable.line.tick_ns))

    def _key(self) -> Any:
        """Return the key of the present frame, which changes with the frame."""
        drawable = self._drawable
        return self._snapshot.run_id, drawable.tick, *drawable.drawn.values()

    def _frame_of(self, key: Any) -> bytes:
        if self._frame[0] != key:
            self._frame = key, _packed(self._drawable)
        return self._frame[1]


def _head_of(line: Any) -> dict[str, Any]:
    """Return the constant data of the page from a decoded Line message."""
    scene = parse_again(line.scene_text, "the scene of the line", parse_overrides(line.overrides))
    return head(line, scene)


def _packed(drawable: DrawableFrame) -> bytes:
    content = BlockContent(signals=[(drawable.tick, drawable.signals)])
    drawn = {topic: decode() for topic, decode in drawable.drawn.items() if topic in ("bottles", "contacts", "belts")}
    if (message := drawn.get("bottles")) is not None:
        content.bottles.append((int(message.tick), TOPICS["bottles"].unpack(message)))
    if (message := drawn.get("contacts")) is not None:
        content.contacts.append((int(message.tick), TOPICS["contacts"].unpack(message)))
    if (message := drawn.get("belts")) is not None:
        content.belts.append((int(message.tick), message.actual))
    return struct.pack("<Bdd", FRAME, drawable.tick, drawable.at) + pack(content, drawable.tick)


def text_message(kind: str, **fields: Any) -> bytes:
    """Return a TEXT message."""
    return bytes([TEXT]) + text({"kind": kind, **fields})
