"""`TimeAccount`: time of a machine by category: running, starved, blocked, ... Sums change only with the category."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, get_args

Category = Literal["running", "starved", "blocked", "down", "planned", "idle"]
"""running: works on bottles; starved: no bottle arrives; blocked: no bottle can leave; down: has failed, until it is
repaired; planned: planned stop; idle: stopped, or not started."""

CATEGORIES: tuple[Category, ...] = get_args(Category)


class TimeAccount:
    """Time of one machine by category, in ticks. Public attributes are stored in checkpoints."""

    category: Category
    """Present category."""
    ticks: dict[str, int]
    """Ticks by category, up to the last change."""

    def __init__(self, category: Category, tick: int = 0) -> None:
        """Start in a category."""
        self.category = category
        self.since = tick
        """Tick of the last change or reset."""
        self.reset(tick)

    def reset(self, tick: int) -> None:
        """Reset all times to 0 at a tick. The category stays."""
        self.since = tick
        self.ticks = dict.fromkeys(CATEGORIES, 0)

    def change(self, tick: int, category: Category) -> None:
        """Change the category at a tick. Without effect if it is the present one."""
        if category != self.category:
            self.ticks[self.category] += tick - self.since
            self.category, self.since = category, tick

    def up_to(self, tick: int) -> Mapping[str, int]:
        """Return the ticks by category since the reset, the present category included."""
        return {**self.ticks, self.category: self.ticks[self.category] + tick - self.since}
