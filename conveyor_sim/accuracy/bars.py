"""Interface of the progress display of a study."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Protocol


class Bar(Protocol):
    """Progress of one stage."""

    def update(self, done: float, total: float | None = None, left: float | None = None) -> None:
        """Take in what is done, the whole, and the time left (s), where it is known."""


Bars = Callable[[str, str], AbstractContextManager[Bar]]
"""Opens the bar of a stage: what it does, and what is counted."""
