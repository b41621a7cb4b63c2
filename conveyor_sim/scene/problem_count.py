# SPDX-License-Identifier: Apache-2.0
"""`ProblemCount`: problems of one validation that are put into words, and problems that are only counted."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

MOST_SAID = 1000
"""Problems of one file that are put into words; 50 of them are listed, in the order of the file."""


@dataclass
class ProblemCount:
    """Counts of one validation."""

    said: int = 0
    """Problems that were put into words."""
    more: int = 0
    """Problems beyond MOST_SAID, which were only counted."""

    @property
    def is_full(self) -> bool:
        """True if no further problem is put into words."""
        return self.said >= MOST_SAID


_counting: ContextVar[ProblemCount | None] = ContextVar("counting", default=None)


@contextmanager
def counting() -> Iterator[ProblemCount]:
    """Bound the words of all validations inside this context."""
    count = ProblemCount()
    token = _counting.set(count)
    try:
        yield count
    finally:
        _counting.reset(token)


def present_count() -> ProblemCount | None:
    """Return the count of the validation under way; None: it is not bounded."""
    return _counting.get()
