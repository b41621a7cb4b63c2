"""`TimeAccount`: how long a machine has been running, starved, blocked, ...; sums grow at changes, not every tick."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, get_args

Category = Literal["running", "starved", "blocked", "down", "planned", "idle"]
"""running: works on bottles; starved: could, and none comes; blocked: could, and nothing takes them; down: has failed,
until it is repaired; planned: stands as planned; idle: was stopped, or has not been started."""

CATEGORIES: tuple[Category, ...] = get_args(Category)


class TimeAccount:
    """Where the time of one machine went, in ticks. Public attributes are remembered in checkpoints."""

    category: Category
    """Present one."""
    ticks: dict[str, int]
    """By category, up to the last change."""

    def __init__(self, category: Category, tick: int = 0) -> None:
        """category: that in which the account opens."""
        self.category = category
        self.since = tick
        """Tick at which it began, or at which all was set to 0."""
        self.reset(tick)

    def reset(self, tick: int) -> None:
        """Count anew from a tick; what is going on goes on, and counts from here."""
        self.since = tick
        self.ticks = dict.fromkeys(CATEGORIES, 0)

    def change(self, tick: int, category: Category) -> None:
        """From a tick on, the machine is in a category; nothing happens where it is in it already."""
        if category != self.category:
            self.ticks[self.category] += tick - self.since
            self.category, self.since = category, tick

    def up_to(self, tick: int) -> Mapping[str, int]:
        """Ticks by category since the reset, what is going on included."""
        return {**self.ticks, self.category: self.ticks[self.category] + tick - self.since}
