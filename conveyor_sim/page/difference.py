# SPDX-License-Identifier: Apache-2.0
"""First tick at which two recordings differ, in words: which commands, signals and bottles, and by how much."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from conveyor_sim.bag.compare import first_difference
from conveyor_sim.bag.messages.encode import to_image, to_outcome
from conveyor_sim.bag.messages.topics import COMPARED, TOPICS, Topic
from conveyor_sim.bag.reader import Bag
from conveyor_sim.columns.bottles import BottleColumns
from conveyor_sim.errors import ConveyorError
from conveyor_sim.page.recording import Stamps

KINDS = {
    "commands": ("outcomes", "readback"),
    "signals": ("signals", "belts"),
    "bottles": (
        "bottles",
        *(name for name, row in COMPARED.items() if row.rate not in (None, "signals", "belts", "bottles")),
    ),
    "seen": ("bottles",),
}
"""Kinds of differences, causes before effects, with their topics in the order of comparison.

`seen` are bottles that are farther apart than SEEN.
"""
SEEN = 1e-3
"""Distance of the positions of a bottle that can be seen, m."""
MOST = 5
"""Sentences per difference, at most."""
_BATCH = 5.0
"""Part of both recordings that is in memory at a time, s."""

Messages = Mapping[str, Sequence[bytes]]
"""Messages of one tick, by topic."""


@dataclass(frozen=True)
class RecordingDifference:
    """First difference of its kind between two recordings, A and B."""

    kind: str
    """One of KINDS."""
    tick: int
    time: float
    """s"""
    texts: tuple[str, ...]
    signals: tuple[str, ...]
    """Names of the signals that differ."""
    bottle: int | None
    """Bottle with the largest distance between its positions in both recordings."""


class RecordingComparison:
    """Comparison of the topics that two recordings share: bit for bit, or within tolerances between two versions."""

    def __init__(self, a: Bag, b: Bag, seconds: float) -> None:
        """seconds: length of a stretch in simulated time. Raise ConveyorError if the lengths of ticks differ."""
        if a.line.tick_ns != b.line.tick_ns:
            raise ConveyorError(
                f"{b.path}: has ticks of {b.line.tick_ns * 1e-6:g} ms, expected those of {a.path}, "
                f"{a.line.tick_ns * 1e-6:g} ms"
            )
        self._bags = (a, b)
        made_by = [(bag.line.engine_hash, list(bag.line.versions), bag.line.machine) for bag in self._bags]
        self.exact = made_by[0] == made_by[1]
        """True if versions and machine are the same, so that every bit counts."""
        rows = [TOPICS["outcomes"], *COMPARED.values()]
        held = [row for row in rows if all(bag.types.get(row.name) == row.type for bag in self._bags)]
        held = [row for row in held if self.exact or row.compare.within or row.name == "outcomes"]
        named = {row.name: row for row in held}
        self._rows = {kind: [named[name] for name in names if name in named] for kind, names in KINDS.items()}
        self._stamps = [Stamps(bag, list(named)) for bag in self._bags]
        self._tick_ns = int(a.line.tick_ns)
        self._first = max(int(bag.line.tick) for bag in self._bags)
        self._last = min(stamps.last for stamps in self._stamps)
        self._length = max(1, round(min(seconds * 1e9 / self._tick_ns, self._last - self._first + 1)))

    @property
    def stretches(self) -> int:
        """Number of stretches up to the end of the shorter recording."""
        return max(1, -(-(self._last + 1 - self._first) // self._length))

    @property
    def end(self) -> float:
        """Simulated time at the end of the shorter recording, s."""
        return self._last * self._tick_ns * 1e-9

    def head(self) -> dict[str, Any]:
        """Return for the page: names of the recordings, end, kind of comparison, and number of stretches."""
        paths = [str(bag.path) for bag in self._bags]
        return {
            "names": paths,
            "start": self._first * self._tick_ns * 1e-9,
            "end": self.end,
            "exact": self.exact,
            "stretches": self.stretches,
        }

    def part(self, number: int = 0) -> list[dict[str, Any]]:
        """Return the differences of a stretch for the page, as `find` does."""
        return [vars(one) for one in self.find(number)]

    def peaks(self, number: int = 0) -> list[dict[str, float] | None]:
        """Return the largest force on a bottle in a stretch: force (N), time (s) and bottle, of A and of B.

        None: the recording has no forces. Raise BagError.
        """
        start = self._first + number * self._length
        stop = min(start + self._length, self._last + 1)
        has_bottles = any(row.name == "bottles" for row in self._rows["bottles"])
        return [self._peak(place, start, stop) if has_bottles else None for place in (0, 1)]

    def _peak(self, place: int, start: int, stop: int) -> dict[str, float] | None:
        most = {"force": 0.0, "time": start * self._tick_ns * 1e-9, "bottle": -1}
        for _, tick, raw in self._stamps[place].messages({"bottles"}, start, stop):
            bottles: BottleColumns = TOPICS["bottles"].unpack(self._bags[place].decode("bottles", raw))
            if not len(bottles.id):
                continue
            index = int(np.argmax(bottles.peak_force))  # the first NaN, if there is one
            if np.isnan(bottles.peak_force[index]):
                return None
            if bottles.peak_force[index] > most["force"]:
                force, bottle = float(bottles.peak_force[index]), int(bottles.id[index])
                most = {"force": force, "time": tick * self._tick_ns * 1e-9, "bottle": bottle}
        return most

    def find(self, number: int = 0) -> list[RecordingDifference]:
        """Return the first difference of each kind in a stretch, counted from 0. Raise BagError."""
        start = self._first + number * self._length
        stop = min(start + self._length, self._last + 1)
        batch = max(1, round(_BATCH * 1e9 / self._tick_ns))
        first: dict[str, RecordingDifference] = {}
        for begin in range(start, stop, batch):
            wanted = [kind for kind in KINDS if kind not in first]
            a, b = (self._messages(stamps, wanted, begin, min(begin + batch, stop)) for stamps in self._stamps)
            for tick in sorted(a.keys() | b.keys()):
                for kind in wanted:
                    one = None if kind in first else self._at(kind, tick, a.get(tick, {}), b.get(tick, {}))
                    if one is not None:
                        first[kind] = one
        return sorted(first.values(), key=lambda one: one.tick)

    def _messages(
        self, stamps: Stamps, kinds: Iterable[str], start: int, stop: int
    ) -> dict[int, dict[str, list[bytes]]]:
        messages: dict[int, dict[str, list[bytes]]] = defaultdict(lambda: defaultdict(list))
        topics = {row.name for kind in kinds for row in self._rows[kind]}
        for topic, tick, raw in stamps.messages(topics, start, stop) if topics else ():
            messages[tick][topic].append(raw)
        return messages

    def _at(self, kind: str, tick: int, a: Messages, b: Messages) -> RecordingDifference | None:
        """Return the difference of a kind at a tick by the first topic that differs; None if there is none."""
        for row in self._rows[kind]:
            raw = a.get(row.name, []), b.get(row.name, [])
            if raw[0] == raw[1] and self._same_names(row):
                continue
            signals: list[str] = []
            texts: list[str] = []
            bottle = None
            if row.name == "outcomes":  # none or many at a tick
                texts = [*_alone(*([*map(_command_text, self._decoded(place, row, raw[place]))] for place in (0, 1)))]
            elif raw[0] and raw[1]:  # else the recordings have different rates
                then, now = (self._decoded(place, row, raw[place])[-1] for place in (0, 1))
                if row.name == "signals":
                    texts, signals = self._signals(then, now)
                elif row.name == "bottles":
                    texts, bottle = self._bottles(row.unpack(then), row.unpack(now), kind == "seen")
                else:
                    texts = self._fields(row, then, now)
            if len(texts) > MOST:
                texts = [*texts[: MOST - 1], f"and {len(texts) - MOST + 1} more"]
            if texts:
                time = tick * self._tick_ns * 1e-9
                return RecordingDifference(kind, tick, time, tuple(texts), tuple(signals), bottle)
        return None

    def _decoded(self, place: int, row: Topic, raw: Iterable[bytes]) -> list[Any]:
        return [self._bags[place].decode(row.name, one) for one in raw]

    def _same_names(self, row: Topic) -> bool:
        names = _NAMES.get(row.name)
        return names is None or self._names(0, names) == self._names(1, names)

    def _names(self, place: int, field: str) -> list[str]:
        return list(getattr(self._bags[place].line, field))

    def _signals(self, then: Any, now: Any) -> tuple[list[str], list[str]]:
        """Return sentences on the signals of both recordings that differ, and their names."""
        names = [self._names(place, "signal_names") for place in (0, 1)]
        units = {tag.name: tag.unit for tag in self._bags[0].line.tags}
        a, b = (
            dict(zip(own, to_image(image).values, strict=False)) for own, image in zip(names, (then, now), strict=True)
        )
        tolerance = 0.0 if self.exact else COMPARED["signals"].compare.within["values"]
        unequal = [name for name in a if name in b and not _near(a[name], b[name], tolerance)]
        return [f"{name} {_two(a[name], b[name], units[name])}" for name in unequal], unequal

    def _bottles(self, a: BottleColumns, b: BottleColumns, seen: bool) -> tuple[list[str], int | None]:
        texts = [
            f"bottle {bottle} is on the line in {name} alone"
            for name, ids, others in (("A", a.id, b.id), ("B", b.id, a.id))
            for bottle in np.setdiff1d(ids, others)
        ]
        both, i, j = np.intersect1d(a.id, b.id, return_indices=True)
        away = np.hypot(a.x[i] - b.x[j], a.y[i] - b.y[j])
        apart = away > (SEEN if seen else 0.0 if self.exact else COMPARED["bottles"].compare.within["x"])
        if apart.any():
            worst = int(np.argmax(away))
            at = [
                f"({s.x[k]:.4f}, {s.y[k]:.4f}) m in {name}" for s, k, name in ((a, i[worst], "A"), (b, j[worst], "B"))
            ]
            others = f"; so are {apart.sum() - 1} other bottles, less far" if apart.sum() > 1 else ""
            texts.append(f"bottle {both[worst]} is {_length(away[worst])} apart: at {at[0]}, {at[1]}{others}")
            return texts, int(both[worst])
        if not texts and not seen:
            texts = self._bottle_fields(a, b, both, i, j)
        return texts, None

    def _bottle_fields(self, a: BottleColumns, b: BottleColumns, both: Any, i: Any, j: Any) -> list[str]:
        """Return a sentence on the first field that differs, for bottles at the same positions."""
        for field, unit in _BOTTLE_FIELDS.items():
            tolerance = 0.0 if self.exact else COMPARED["bottles"].compare.within.get(field, 0.0)
            then, now = getattr(a, field)[i], getattr(b, field)[j]
            unequal = [k for k in range(len(both)) if not _near(then[k], now[k], tolerance)]
            if unequal:
                return [f"{field} of bottle {both[unequal[0]]} {_two(then[unequal[0]], now[unequal[0]], unit)}"]
        return []

    def _fields(self, row: Topic, then: Any, now: Any) -> list[str]:
        if not self._same_names(row):
            return []
        difference = first_difference(row.name, self._bags[1].line, then, now, exact=self.exact)
        if difference is None:
            return []
        part = f" of {difference.part}" if difference.part else ""
        return [f"{row.name}: {difference.field}{part} is {difference.recorded} in A, {difference.replayed} in B"]


_NAMES = {
    "signals": "signal_names",
    "belts": "belts",
    "readback": "command_names",
    "contacts": "rails",
    "rail_wear": "rails",
}
"""Field of Line with the names of a topic's entries, by topic."""
_BOTTLE_FIELDS = {
    "type": "1", "theta": "rad", "vx": "m/s", "vy": "m/s", "omega": "rad/s", "belt": "1", "peak_force": "N",
    "impulse": "N s",
}  # fmt: skip
"""Compared fields of bottles, with their units."""


def _command_text(message: Any) -> str:
    """Return a command and its result in words."""
    outcome = to_outcome(message)
    requests = [*map(repr, outcome.values), *map(repr, outcome.texts)]
    values = [f"{name} = {value}" for name, value in zip(outcome.names, requests, strict=False)] or [outcome.operation]
    refused = "" if outcome.accepted else f", refused: {outcome.reason}"
    return f"command {', '.join(values)} by {outcome.writer or outcome.source}{refused}"


def _alone(a: Sequence[str], b: Sequence[str]) -> Iterator[str]:
    """Yield the texts that only one of two lists has."""
    yield from (f"in A alone: {text}" for text in a if text not in b)
    yield from (f"in B alone: {text}" for text in b if text not in a)


def _near(a: float, b: float, tolerance: float) -> bool:
    return bool(a == b or (np.isnan(a) and np.isnan(b)) or abs(a - b) <= tolerance)


def _two(a: float, b: float, unit: str) -> str:
    """Return two values in words, with enough digits to distinguish them."""
    measure = "" if unit == "1" else f" {unit}"
    apart = abs(float(a) - float(b))
    digits = next((digits for digits in range(4, 17) if f"{a:.{digits}g}" != f"{b:.{digits}g}"), 17)
    by = f" ({apart:.3g}{measure} apart)" if np.isfinite(apart) and digits > 4 else ""
    return f"is {a:.{digits}g}{measure} in A, {b:.{digits}g}{measure} in B{by}"


def _length(metres: float) -> str:
    return f"{metres * 1e3:.3g} mm" if metres >= 1e-6 else f"{metres:.2g} m"
