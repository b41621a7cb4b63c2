# SPDX-License-Identifier: Apache-2.0
"""Numbers of bottles that entered and left."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Counts:
    """Numbers of bottles since the start."""

    fed: int
    """Bottles that entered through infeeds."""
    removed: int
    """Bottles that left through outfeeds."""
    present: int
    blocked_ticks: int
    """Ticks at which an infeed had a bottle to feed but no room."""
    held: int = 0
    """Bottles inside stations. fed + number at the start = removed + present + held."""
