"""Functions that other threads want called by the stepping thread, between two ticks, in the order of their arrival."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar

from conveyor_sim.run.lockstep import Refused

T = TypeVar("T")
MOST_CALLS = 100
"""Requests that may wait for their answers at once; a reset that records takes 0.1 s of the stepping thread."""


class Calls:
    """A queue that the stepping thread empties; all but `take` and `wait` may be called by any thread."""

    def __init__(self) -> None:
        self.ended = False
        """Whether the stepping thread is to end."""
        self._waiting: deque[Callable[[], None]] = deque()
        self._requests = 0  # of those that wait, the ones that came by `request`
        self._wake = threading.Condition()

    def request(self, function: Callable[[], T]) -> Future[T]:
        """Have a function called, and get what it returns; Refused, in the future, if too many wait already."""
        future: Future[T] = Future()
        with self._wake:
            full = self._requests >= MOST_CALLS
            self._requests += not full
        if full:
            future.set_exception(Refused(f"{MOST_CALLS} requests wait for their answers already, expected fewer"))
            return future

        def run() -> None:
            with self._wake:
                self._requests -= 1
            try:
                future.set_result(function())
            except Exception as error:
                future.set_exception(error)

        self.put(run)
        return future

    def put(self, function: Callable[[], None]) -> None:
        """Have a function called that answers nobody."""
        with self._wake:
            self._waiting.append(function)
            self._wake.notify()

    def end(self) -> None:
        """Have the stepping thread end after what it is at."""
        with self._wake:
            self.ended = True
            self._wake.notify()

    def take(self) -> None:
        """Call all that wait, until the end."""
        while self._waiting and not self.ended:
            self._waiting.popleft()()

    def wait(self, seconds: float) -> None:
        """Until something comes, or so long."""
        with self._wake:
            if not self._waiting and not self.ended:
                self._wake.wait(seconds)
