"""`Gaps`: counts lost messages from the sequence numbers of DDS, which each publisher has.

Fast DDS reports no message-lost event for messages that a full history drops, but their numbers are missing. rclpy
passes the number without the publisher. With one publisher, the count is exact from the first received message on. With
several, numbers are assigned to the best fitting publisher, and a gap may look like a new publisher, once for each.
"""

from __future__ import annotations

from collections.abc import Callable


class Gaps:
    """Sequence numbers of the messages of one topic, until all its publishers have left."""

    def __init__(self) -> None:
        self._last: list[int] = []  # last number of each known publisher, the most recent one at the end

    def before(self, number: int | None, publishers: Callable[[], int]) -> int:
        """Return the number of missing messages before a number (None if the middleware has no numbers).

        publishers: returns the present number of publishers.
        """
        if number is None:
            return 0
        if number - 1 in self._last:
            self._last.remove(number - 1)
            self._last.append(number)
            return 0
        present = max(1, publishers())
        del self._last[: max(0, len(self._last) - present)]  # their publishers have left
        earlier = [last for last in self._last if last < number]
        if not earlier or len(self._last) < present:
            self._last.append(number)  # the first message of a publisher
            return 0
        self._last.remove(max(earlier))
        self._last.append(number)
        return number - max(earlier) - 1
