# SPDX-License-Identifier: Apache-2.0
"""Functions of other threads, called by the stepping thread between two ticks in the order of their arrival."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar

from conveyor_sim.run.lockstep import Refused

T = TypeVar("T")
MOST_CALLS = 100
"""Largest number of requests that wait at the same time: 10 s of resets of a recorded run, which take 0.1 s each."""


class CallQueue:
    """Queue of functions. Any thread may call its methods, but `take` and `wait` are for the stepping thread."""

    def __init__(self, end: str = "the thread has ended") -> None:
        """end: why calls after the end are refused."""
        self._end = end
        self.ended = False
        """True once the stepping thread must end."""
        self._waiting: deque[Callable[[], None]] = deque()
        self._requests = 0  # number of waiting functions that came by `request`
        self._wake = threading.Condition()

    def request(self, function: Callable[[], T]) -> Future[T]:
        """Queue a function. Return a future of its result. It raises Refused if too many wait, or after `end`."""
        future: Future[T] = Future()

        def run() -> None:
            with self._wake:
                self._requests -= 1
            settle(future, function)

        with self._wake:
            reason = self._end if self.ended else ""
            if self._requests >= MOST_CALLS:
                reason = f"{MOST_CALLS} requests wait for their answers already, expected fewer"
            if not reason:
                self._requests += 1
                self._waiting.append(run)
                self._wake.notify()
        if reason:
            future.set_exception(Refused(reason))
        return future

    def put(self, function: Callable[[], None]) -> None:
        """Queue a function without a result."""
        with self._wake:
            self._waiting.append(function)
            self._wake.notify()

    def end(self) -> None:
        """End the stepping thread once the function that it executes has returned."""
        with self._wake:
            self.ended = True
            self._wake.notify()

    def take(self) -> None:
        """Call all functions that wait, until `end` is called."""
        while self._waiting and not self.ended:
            self._waiting.popleft()()

    def drain(self) -> None:
        """Call all functions that still wait after `end`."""
        while self._waiting:
            self._waiting.popleft()()

    def wait(self, seconds: float) -> None:
        """Block until a function arrives or `seconds` have passed."""
        with self._wake:
            if not self._waiting and not self.ended:
                self._wake.wait(seconds)


def settle(future: Future[T], function: Callable[[], T]) -> None:
    """Set the result of a future to that of a function, or to its exception."""
    try:
        future.set_result(function())
    except Exception as error:
        future.set_exception(error)
