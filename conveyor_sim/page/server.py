# SPDX-License-Identifier: Apache-2.0
"""A server on this machine for the page of a recording of any length. Each request is read by the recording's index."""

from __future__ import annotations

import threading
import zlib
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path

from conveyor_sim.bag.reader import Bag, open_bag
from conveyor_sim.page.difference import RecordingComparison
from conveyor_sim.page.http_host import PageHost
from conveyor_sim.page.recording import Detail, PageRecording, text

SERVED = Detail(bottles=50.0, contacts=25.0, belts=50.0, signals=50.0, block=2.0, story=60.0)


class RecordingServer(AbstractContextManager["RecordingServer"]):
    """Server of a bag's page; it serves until it is closed."""

    def __init__(self, path: Path, port: int = 0, other: Path | None = None) -> None:
        """port: 0 for any free port. other: a recording that is shown beside it, at the same times.

        Raise BagError, SceneError, and ConveyorError if the port is taken, or the recordings can't be compared.
        """
        with ExitStack() as stack:
            self._bags = [path] if other is None else [path, other]
            self._blocks = [PageRecording(self._opened(bag, stack), SERVED) for bag in self._bags]
            # Blocks on display and the story are read in parallel, each by its own reader. That of the story is opened
            # at the first request for it, after the first frame.
            self._later = stack.enter_context(ExitStack())
            self._stories: list[PageRecording] = []
            self._comparison: RecordingComparison | None = None
            if other is not None:
                a, b = (self._opened(bag, stack) for bag in self._bags)
                self._comparison = RecordingComparison(a, b, SERVED.story)
            self._block_lock, self._story_lock = threading.Lock(), threading.Lock()
            self._host = stack.enter_context(PageHost(self.answer, port))
            self._stack = stack.pop_all()

    @staticmethod
    def _opened(bag: Path, stack: ExitStack) -> Bag:
        return stack.enter_context(open_bag(bag, by_index=True))

    def _story(self, place: int, number: int) -> bytes:
        """Return a stretch of the story of a recording."""
        if not self._stories:
            self._stories = [PageRecording(self._opened(bag, self._later), SERVED) for bag in self._bags]
        return self._stories[place].story(number)

    @property
    def url(self) -> str:
        """Address of the page."""
        return self._host.url

    def answer(self, name: str) -> bytes:
        """Return the deflated part with a name. Raise KeyError if there is none, and BagError.

        Names: head, fullest, story/<n> and block/<n>, each of them after other/ for the other recording; difference/<n>
        and peaks/<n>.
        """
        place = int(name.startswith("other/"))
        if place >= len(self._blocks):
            raise KeyError(name)
        kind, _, number = name.removeprefix("other/").partition("/")
        blocks, comparison = self._blocks[place], self._comparison
        if kind == "head" and not number:
            compared = {"compared": comparison.head()} if comparison is not None and not place else {}
            return self._deflated(self._block_lock, lambda: text({**blocks.head(), **compared}))
        if kind == "fullest" and not number:
            return self._deflated(self._block_lock, lambda: text(blocks.fullest()))
        counts = {"story": blocks.stories, "block": blocks.blocks}
        if comparison is not None and not place:
            counts["difference"] = counts["peaks"] = comparison.stretches
        if kind not in counts or not (number.isdecimal() and len(number) < 10) or int(number) >= counts[kind]:
            raise KeyError(name)
        if kind == "block":
            return self._deflated(self._block_lock, lambda: blocks.block(int(number)))
        if kind == "difference" and comparison is not None:
            return self._deflated(self._story_lock, lambda: text(comparison.part(int(number))))
        if kind == "peaks" and comparison is not None:
            return self._deflated(self._story_lock, lambda: text(comparison.peaks(int(number))))
        return self._deflated(self._story_lock, lambda: self._story(place, int(number)))

    def __exit__(self, *_: object) -> None:
        """Stop the server."""
        self._stack.close()

    def _deflated(self, lock: threading.Lock, make: Callable[[], bytes]) -> bytes:
        with lock:
            part = make()
        return zlib.compress(part, 1)
