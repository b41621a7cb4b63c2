"""`Intake`: a thread that takes commands and lockstep requests for the line, in the order they were sent.

DDS keeps the order of messages within one topic only. On one machine, messages sent by a process before a request have
arrived before it. The thread therefore hands over all commands before a request that it has taken.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import Protocol

from rclpy.context import Context
from rclpy.subscription import Subscription

from conveyor_sim.ros.direct import WaitSet
from conveyor_sim.ros.lockstep_service import LockstepService


class TakenTopic(Protocol):
    """A subscription in the group `Aside`."""

    @property
    def subscription(self) -> Subscription:
        """Subscription that the thread waits for."""

    def take_all(self) -> None:
        """Hand over the messages that have come."""


class Intake:
    """Thread that runs until close()."""

    def __init__(
        self,
        context: Context,
        lockstep: LockstepService,
        topics: Sequence[TakenTopic] = (),
        *,
        died: Callable[[Exception], None],
    ) -> None:
        """died: called by the thread with an exception that ended it."""
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
        """End the thread."""
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
