"""`Timer`: on-delay and off-delay of a switching signal, in simulated time."""

from collections.abc import Sequence

ROUNDING = 1e-9
"""s; what lasts exactly as long as a delay is long enough, whatever its sum was rounded to."""

Edge = tuple[float, bool]
"""When (s) a signal changes, and whether it comes on."""


class Timer:
    """Its output comes on once the input has been on for `on` s, and goes off once that has been off for `off` s.

    TON and TOF of IEC 61131-3 in one, with edges at any time between ticks.
    """

    def __init__(self, on: float, off: float) -> None:
        self._on, self._off = on, off
        self.input = self.output = False
        self.since = 0.0
        """s: when the input last changed."""

    def start(self, level: bool) -> None:
        """Begin as if the input had always been so."""
        self.input = self.output = level

    @property
    def runs(self) -> bool:
        """Whether its output is still to follow its input."""
        return self.input != self.output

    def follow(self, edges: Sequence[Edge], until: float) -> list[Edge]:
        """The output's edges up to a time (s), after the input's up to then, which are in order."""
        made: list[Edge] = []
        for at, level in edges:
            self._ripen(at, made)
            if level != self.input:
                self.input, self.since = level, at
        self._ripen(until, made)
        return made

    def _ripen(self, now: float, made: list[Edge]) -> None:
        due = self.since + (self._on if self.input else self._off)
        if self.input != self.output and due <= now + ROUNDING:
            self.output = self.input
            made.append((due, self.output))
