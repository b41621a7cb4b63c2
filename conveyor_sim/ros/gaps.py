"""Messages that were sent and never came, from the numbers that DDS gives to each publisher's messages.

Fast DDS reports no message-lost event for what a full history drops, but its numbers have gaps there. rclpy gives the
number without the publisher. With one publisher the count is exact, from the first message on that is received; with
several, numbers are matched to publishers as they fit best, and a gap may be taken for a new publisher, once for each.
"""

from __future__ import annotations

from collections.abc import Callable


class Gaps:
    """The numbers of one topic's messages, until all its publishers have left."""

    def __init__(self) -> None:
        self._last: list[int] = []  # of each publisher heard of; the one heard of last is at the end

    def before(self, number: int | None, publishers: Callable[[], int]) -> int:
        """How many messages are missing before one with this number (None where the middleware has none).

        publishers: how many there are now.
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
            self._last.append(number)  # the first one heard of a publisher
            return 0
        self._last.remove(max(earlier))
        self._last.append(number)
        return number - max(earlier) - 1
