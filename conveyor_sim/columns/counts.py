# SPDX-License-Identifier: Apache-2.0
"""Numbers of bottles that entered and left."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Counts:
    """Numbers of bottles since the start."""

    fed: int
    """Bottles put onto the line by infeeds, sources and spills."""
    removed: int
    """Bottles taken off the line by outfeeds, sinks and rejects."""
    present: int
    blocked_ticks: int
    """Ticks at which a device had a bottle to feed but no room; the sum over infeeds, sources and stations."""
    held: int = 0
    """Bottles inside stations. fed + number at the start = removed + present + held."""
