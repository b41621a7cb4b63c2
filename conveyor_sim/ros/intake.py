"""The thread that takes what comes for the line: commands and lockstep requests, none of which overtakes another.

DDS keeps the order of the messages of one topic only. But on one machine, what a process sent before a request has been
received before it. So whoever has taken a request finds the commands sent before it, and hands them over first.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import Protocol

from rclpy.context import Context
from rclpy.subscription import Subscription

from conveyor_sim.ros.direct import WaitSet
from conveyor_sim.ros.lockstep_service import LockstepService


class Topic(Protocol):
    """A subscription in the group `Aside`."""

    @property
    def subscription(self) -> Subscription: ...

    def take_all(self) -> None:
        """Hand over what has come."""


class Intake:
    """Runs from the start to close()."""

    def __init__(
        self,
        context: Context,
        lockstep: LockstepService,
        topics: Sequence[Topic] = (),
        *,
        died: Callable[[Exception], None],
    ) -> None:
        """`died` is called, from the thread, with an exception that ended it."""
        self._lockstep = lockstep
        self._topics = topics
        self._died = died
        self._closing = False
        self._waiting = WaitSet(
            context, subscriptions=[topic.subscription for topic in topics], services=[lockstep.service]
        )
        self._thread = threading.Thread(target=self._run, name="intake", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Return once nothing more is taken."""
        self._closing = True
        self._waiting.wake()
        self._thread.join()
        self._waiting.close()

    def _run(self) -> None:
        try:
            while not self._closing:
                self._waiting.wait()
                request = self._lockstep.take()
                for topic in self._topics:
                    topic.take_all()
                if request is not None:
                    self._lockstep.serve(*request)
        except Exception as error:
            self._died(error)
