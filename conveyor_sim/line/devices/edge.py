"""Edges of a switch: what rises from 0 to 1 between two scans."""

from dataclasses import dataclass


@dataclass
class RisingEdge:
    """Remembers a switch."""

    on: bool = False

    def rises(self, value: float) -> bool:
        """Whether it is on now and was not before."""
        before, self.on = self.on, value != 0.0
        return self.on and not before
