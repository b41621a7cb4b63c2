"""`PrimaryHost`: whether the host application is there without which an edge node is not to send anything."""

from __future__ import annotations

import json

STATE = "spBv1.0/STATE"
"""Topic, below which each host application says whether it is online."""


class PrimaryHost:
    """One of them, as its messages of STATE have it (Sparkplug 3.0, 5.4)."""

    def __init__(self, name: str) -> None:
        """name: its id; empty: none is waited for."""
        self.topic = f"{STATE}/{name}" if name else ""
        self.online = not name
        self._stamp = float("-inf")  # ms, of the last message that counted

    def hear(self, data: bytes) -> None:
        """A message of its topic; what is none, or older than the one before, changes nothing."""
        try:
            said = json.loads(data)
            online, stamp = said["online"], float(said["timestamp"])
        except (ValueError, TypeError, KeyError, RecursionError):
            return
        if isinstance(online, bool) and stamp >= self._stamp:
            self.online, self._stamp = online, stamp
