"""Scans by hand: what a controller answers to signals, and the signals that bottles on a belt would make."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence

from conveyor_sim.control.scan import Controller, Inputs

LENGTH = 0.01  # s, of a scan


class Scans:
    """Scans a controller; the signals that are not told stay as they were."""

    def __init__(self, controller: Controller, length: float = LENGTH, **signals: float) -> None:
        self.tick = 0
        self._controller = controller
        self._length = length
        self._signals = dict(signals)

    @property
    def time(self) -> float:
        """s, of the scan to come."""
        return self.tick * self._length

    def scan(self, signals: Mapping[str, float]) -> dict[str, float]:
        """The answer to one scan."""
        self._signals.update(signals)
        inputs = Inputs(self._signals, self.time, self.tick, self._length)
        self.tick += 1
        return dict(self._controller.scan(inputs))

    def hold(self, seconds: float, signals: Mapping[str, float] | None = None) -> dict[str, float]:
        """The answer to the last of so many seconds of scans."""
        answer: dict[str, float] = {}
        for _ in range(round(seconds / self._length)):
            answer = self.scan(signals or {})
        return answer

    def until(self, key: str, value: float, seconds: float, signals: Mapping[str, float] | None = None) -> float:
        """s until the answer has that value; no more than so many seconds."""
        start = self.time
        for _ in range(round(seconds / self._length)):
            if self.scan(signals or {}).get(key) == value:
                return self.time - self._length - start
        raise AssertionError(f"{key} was not {value:g} within {seconds:g} s")

    def table(self, rows: Iterable[tuple[float, Mapping[str, float]]]) -> list[dict[str, float]]:
        """The answers after each row: seconds, and the signals that change."""
        return [self.hold(seconds, signals) for seconds, signals in rows]


class Beam:
    """A photo-eye that sees intervals [front, back] of a belt pass, as a function of the belt's travel."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._blocked, self._rose, self._fell, self._edges = False, 0.0, 0.0, 0

    def signals(self) -> dict[str, float]:
        """As a device would tell them."""
        values = {"blocked": self._blocked, "rose": self._rose, "fell": self._fell, "edges": self._edges}
        return {f"photo_eyes/{self.name}/{what}": float(value) for what, value in values.items()}

    def pass_by(self, edges: Sequence[float], before: float, after: float, time: float, length: float) -> None:
        """The belt's travel goes from `before` to `after` (m) in the scan that ends at `time`; edges: m, in order."""
        for edge in edges[bisect_right(edges, before) : bisect_right(edges, after)]:
            self.toggle(time - length * (after - edge) / (after - before))

    def toggle(self, time: float) -> None:
        """An edge."""
        self._blocked = not self._blocked
        self._edges += 1
        if self._blocked:
            self._rose = time
        else:
            self._fell = time


def edges_of(fronts: Iterable[float], diameter: float) -> list[float]:
    """Travel (m) at which bottles begin and end to block a beam, whose fronts arrive at those travels."""
    return [edge for front in fronts for edge in (front, front + diameter)]
