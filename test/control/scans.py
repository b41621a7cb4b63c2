# SPDX-License-Identifier: Apache-2.0
"""Controllers scanned by hand, and the signals that bottles on a belt would make."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence

from conveyor_sim.control.scan import Controller, Inputs

LENGTH = 0.01  # s, of a scan


class Scans:
    """Scans of a controller. Signals that are not set keep their values."""

    def __init__(self, controller: Controller, length: float = LENGTH, **signals: float) -> None:
        self.tick = 0
        self._controller = controller
        self._length = length
        self._signals = dict(signals)

    @property
    def time(self) -> float:
        """Time of the next scan, s."""
        return self.tick * self._length

    def scan(self, signals: Mapping[str, float]) -> dict[str, float]:
        """Return the answer to one scan."""
        self._signals.update(signals)
        inputs = Inputs(self._signals, self.time, self.tick, self._length)
        self.tick += 1
        return dict(self._controller.scan(inputs))

    def hold(self, seconds: float, signals: Mapping[str, float] | None = None) -> dict[str, float]:
        """Return the answer to the last of the scans within `seconds`."""
        answer: dict[str, float] = {}
        for _ in range(round(seconds / self._length)):
            answer = self.scan(signals or {})
        return answer

    def until(self, key: str, value: float, seconds: float, signals: Mapping[str, float] | None = None) -> float:
        """Return the time until the answer has a value, s; at most `seconds`."""
        start = self.time
        for _ in range(round(seconds / self._length)):
            if self.scan(signals or {}).get(key) == value:
                return self.time - self._length - start
        raise AssertionError(f"{key} was not {value:g} within {seconds:g} s")

    def table(self, rows: Iterable[tuple[float, Mapping[str, float]]]) -> list[dict[str, float]]:
        """Return the answers after each row: seconds, and the signals that change."""
        return [self.hold(seconds, signals) for seconds, signals in rows]


class Beam:
    """Photo-eye that intervals [front, back] of a belt pass, as a function of the belt's travel."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._blocked, self._rose, self._fell, self._edges = False, 0.0, 0.0, 0

    def signals(self) -> dict[str, float]:
        """Return the signals as a device reports them."""
        values = {"blocked": self._blocked, "rose": self._rose, "fell": self._fell, "edges": self._edges}
        return {f"photo_eyes/{self.name}/{what}": float(value) for what, value in values.items()}

    def pass_by(self, edges: Sequence[float], before: float, after: float, time: float, length: float) -> None:
        """Move the belt from `before` to `after` (m) in the scan that ends at `time`.

        edges: m, in order.
        """
        for edge in edges[bisect_right(edges, before) : bisect_right(edges, after)]:
            self.toggle(time - length * (after - edge) / (after - before))

    def toggle(self, time: float) -> None:
        """Make an edge."""
        self._blocked = not self._blocked
        self._edges += 1
        if self._blocked:
            self._rose = time
        else:
            self._fell = time


def edges_of(fronts: Iterable[float], diameter: float) -> list[float]:
    """Return the travels (m) at which bottles start and end to block a beam.

    The fronts arrive at the given travels.
    """
    return [edge for front in fronts for edge in (front, front + diameter)]
