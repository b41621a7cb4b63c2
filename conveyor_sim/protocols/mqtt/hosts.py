"""`PrimaryHost`: state of the primary host application, without which an edge node sends nothing."""

from __future__ import annotations

import json

STATE = "spBv1.0/STATE"
"""Topic below which each host application publishes whether it is online."""


class PrimaryHost:
    """State of a host application by its STATE messages (Sparkplug 3.0, 5.4)."""

    def __init__(self, name: str) -> None:
        """Start offline. name: ID of the host; empty: there is none, and the state is always online."""
        self.topic = f"{STATE}/{name}" if name else ""
        self.online = not name
        self._stamp = float("-inf")  # time stamp of the latest accepted message, ms

    def hear(self, data: bytes) -> None:
        """Take a message of its topic. Malformed and outdated messages have no effect."""
        try:
            said = json.loads(data)
            online, stamp = said["online"], float(said["timestamp"])
        except (ValueError, TypeError, KeyError, RecursionError):
            return
        if isinstance(online, bool) and stamp >= self._stamp:
            self.online, self._stamp = online, stamp
