"""How many bottles came and went."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Counts:
    """Bottles so far."""

    fed: int
    """Entered through infeeds."""
    removed: int
    """Left through outfeeds."""
    present: int
    blocked_ticks: int
    """Ticks at which an infeed had a bottle to feed and no room."""
    held: int = 0
    """In stations: not on the line, and not removed. fed + at the start = removed + present + held."""
