# SPDX-License-Identifier: Apache-2.0
"""`Frames`: updates of a line mirror, collected in bounded memory for one process that copies it."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable

from conveyor_sim.protocols.hosting.server_messages import LIFE_SIGN, LineFrame
from conveyor_sim.protocols.server.interface import Health
from conveyor_sim.protocols.tags.line_mirror import DRAWING_TOPICS, DrawableProvider
from conveyor_sim.protocols.tags.tag_provider import MOST_EVENTS

MOST_FRAMES, MOST_BYTES = 100, 16 * 1024 * 1024
"""Frames that wait to be sent, and bytes of their messages; beyond either, the newest ones are merged."""

HEALTH = 1.0
"""s of wall time between two reports of the health of all protocol servers."""


class Frames:
    """Frames for one process. The thread of the mirror adds frames; another thread fetches and sends them.

    A process that is far behind misses ticks, not states: merged frames hold the newest message of each topic, and up
    to MOST_EVENTS events.
    """

    def __init__(self, view: DrawableProvider, servers: Callable[[], tuple[Health, ...]] | None = None) -> None:
        """Collect from now on; the first frame holds everything that the mirror shows.

        servers: returns the health of all protocol servers, which frames then carry every HEALTH seconds.
        """
        self._view, self._servers = view, servers
        self._wake = threading.Condition(threading.RLock())
        self._waiting: deque[LineFrame] = deque()
        self._bytes = 0  # of the messages in them
        self._states: dict[str, bytes] = {}  # messages since the last frame
        self._passed: deque[bytes] = deque(maxlen=MOST_EVENTS)
        self._anew = self._ended = self._watched = False
        self._era, self._total, self._tick = -1, 0, -1
        self._reported = 0.0  # s of wall time of the last report of health
        self.counts = True
        """False while the process does not serve yet: then `left_out` does not change."""
        self.left_out = 0
        """Ticks that were never sent to the process, because it was too far behind."""
        with self._wake:
            self._ends = (view.hear(self._hear), view.listen(self._listen))
            self._listen()

    def fetch(self) -> LineFrame | None:
        """Block until there is a frame, or for LIFE_SIGN seconds, and return it; None once this has ended."""
        with self._wake:
            self._wake.wait_for(lambda: self._waiting or self._ended, LIFE_SIGN)
            if self._ended:
                return None
            frame = self._waiting.popleft() if self._waiting else self._cut({}, 0)
            self._bytes -= _size(frame)
        now = time.monotonic()
        if self._servers is not None and now > self._reported + HEALTH:
            self._reported = now
            return frame._replace(servers=self._servers())
        return frame

    def watch(self, on: bool) -> None:
        """Start or stop collecting the topics DRAWING_TOPICS as well."""
        with self._wake:
            self._watched = on
            if on:
                self._states |= {
                    topic: data for topic, data in dict(self._view.newest).items() if topic in DRAWING_TOPICS
                }
                self._listen()

    def end(self) -> None:
        """Stop collecting."""
        for end in self._ends:
            end()
        with self._wake:
            self._ended = True
            self._wake.notify_all()

    # Called by the thread of the mirror

    def _hear(self, topic: str, data: bytes) -> None:
        with self._wake:
            self._renew()
            if topic == "events":
                self._passed.append(data)
            elif self._wants(topic):
                self._states[topic] = data

    def _listen(self) -> None:
        with self._wake:
            self._renew()
            states, self._states = self._states, {}
            frame = self._cut(states, 1)
            last = self._waiting[-1] if self._waiting else None
            if last is not None and (len(self._waiting) >= MOST_FRAMES or self._bytes > MOST_BYTES):
                self._bytes -= _size(last)
                frame = self._waiting[-1] = _merged(last, frame)
                self.left_out += self.counts and self._tick != self._view.snapshot.tick
            else:
                self._waiting.append(frame)
            self._bytes += _size(frame)
            self._tick = self._view.snapshot.tick
            self._wake.notify()

    def _renew(self) -> None:
        """Replace collected messages with the newest ones, after a reset or seek."""
        if self._era != (era := self._view.era):
            self._era, self._anew = era, True
            newest = dict(self._view.newest)
            self._states = {topic: data for topic, data in newest.items() if topic != "events" and self._wants(topic)}

    def _wants(self, topic: str) -> bool:
        return self._watched or topic not in DRAWING_TOPICS

    def _cut(self, states: dict[str, bytes], is_new: int) -> LineFrame:
        view, passed, anew = self._view, tuple(self._passed), self._anew
        self._passed.clear()
        self._anew = False
        total, events = view.events(self._total)
        self._total, now = total, view.snapshot
        return LineFrame(
            anew,
            states,
            passed,
            total,
            events,
            is_new,
            now.run,
            now.lost,
            now.owner,
            now.released,
            view.frame.at,
            (),
        )


def _merged(old: LineFrame, new: LineFrame) -> LineFrame:
    if new.anew:
        old = old._replace(states={})
    return new._replace(
        anew=old.anew or new.anew,
        states={**old.states, **new.states},
        passed=[*old.passed, *new.passed][-MOST_EVENTS:],
        events=(*old.events, *new.events)[-MOST_EVENTS:],
    )


def _size(frame: LineFrame) -> int:
    return sum(map(len, frame.states.values()))
