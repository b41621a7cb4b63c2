"""`Refusals`: count and log of requests on subscriptions that another session owns."""

from __future__ import annotations

import logging
import time

EVERY = 10.0
"""Shortest interval between two log lines, s of wall time."""


class Refusals:
    """Count of refused requests. The log gets one line at once, then at most one line per `EVERY` seconds."""

    def __init__(self) -> None:
        """Start with a count of 0."""
        self.count = 0
        """Refused requests so far."""
        self._logged, self._at = 0, -EVERY

    def report(self, sentence: str) -> None:
        """Count one refusal, and log it unless the previous line is too recent."""
        self.count += 1
        now = time.monotonic()
        if now - self._at < EVERY:
            return
        others = self.count - self._logged - 1
        more = f" ({others} more refused since the last line)" if others else ""
        logging.getLogger(__name__).warning("opcua: %s%s", sentence, more)
        self._logged, self._at = self.count, now
