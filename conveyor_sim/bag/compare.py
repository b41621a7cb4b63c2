"""Finds where two messages of one tick differ first, bit for bit or within a tolerance."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.bag.reader import Outcome
from conveyor_sim.observe.columns import BeltColumns, BottleColumns, ContactColumns
from conveyor_sim.observe.damage import DamageColumns, RailWearColumns
from conveyor_sim.observe.ledger import Ledger

TOLERANCE = {
    "x": 1e-6,
    "y": 1e-6,
    "theta": 1e-5,
    "vx": 1e-4,
    "vy": 1e-4,
    "omega": 1e-3,
    "peak_force": 1e-2,
    "impulse": 1e-4,
    "commanded": 1e-9,
    "actual": 1e-9,
    "values": 1e-4,
}
"""Absolute, in the SI unit of the field (m, rad, m/s, rad/s, N, N s), plus RELATIVE of the value; other fields exactly.

Wide against rounding, narrow against a collision that went another way: a dense line is chaotic, so runs on different
machines do part in the end.
"""
RELATIVE = 1e-6


@dataclass(frozen=True)
class Difference:
    """Where a replay first differs from its recording."""

    tick: int
    time: float
    """s"""
    topic: str
    field: str
    recorded: str
    replayed: str
    bottle: int | None = None
    """Id, where the field belongs to a bottle (of a contact: its bottle a)."""
    part: str = ""
    """Which entry, in words: "bottle 17", "belt feeder"."""

    def __str__(self) -> str:
        part = f" of {self.part}" if self.part else ""
        return (
            f"tick {self.tick} ({self.time:.4f} s), topic {self.topic}: {self.field}{part} "
            f"was recorded as {self.recorded} and replayed as {self.replayed}"
        )


def _bottle_name(line: Any, message: Any, index: int) -> str:
    return f"bottle {message.id[index]}"


def _contact_name(line: Any, message: Any, index: int) -> str:
    other = int(message.b[index])
    if message.kind[index] == 0:
        return f"the contact of bottles {message.a[index]} and {other}"
    rail = line.rails[other] if other < len(line.rails) else other
    return f"the contact of bottle {message.a[index]} and rail {rail}"


def _bin_name(line: Any, message: Any, index: int) -> str:
    return f"rail {line.rails[message.rail[index]]} at ({message.x[index]:.4g}, {message.y[index]:.4g}) m"


@dataclass(frozen=True)
class _Comparer:
    """The columns of a topic, how to name an entry of them, and the column that holds its bottle's id."""

    columns: tuple[str, ...]
    name: Callable[[Any, Any, int], str]
    bottle: str | None = None


def _columns(kind: type[Any]) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind))


COMPARERS = {
    "bottles": _Comparer(_columns(BottleColumns), _bottle_name, "id"),
    "contacts": _Comparer(_columns(ContactColumns), _contact_name, "a"),
    "belts": _Comparer(_columns(BeltColumns), lambda line, _, index: f"belt {line.belts[index]}"),
    "signals": _Comparer(("values",), lambda line, _, index: f"signal {line.signal_names[index]}"),
    "ledger": _Comparer(_columns(Ledger), lambda *_: ""),
    "damage": _Comparer(_columns(DamageColumns), _bottle_name, "id"),
    "rail_wear": _Comparer(_columns(RailWearColumns), _bin_name),
}
"""By topic, in the order in which differences of one tick are looked for."""


def first_difference(topic: str, line: Any, recorded: Any, replayed: Any, *, exact: bool) -> Difference | None:
    """Compares two decoded messages; `replayed` gives the tick and names the entries. None if they are equal."""
    comparer = COMPARERS[topic]
    tick = int(replayed.tick)
    time = tick * line.tick_ns * 1e-9

    def found(field: str, then: object, now: object, index: int | None = None) -> Difference:
        bottle = None if index is None or comparer.bottle is None else int(getattr(replayed, comparer.bottle)[index])
        part = "" if index is None else comparer.name(line, replayed, index)
        return Difference(tick, time, topic, field, str(then), str(now), bottle, part)

    if recorded.tick != replayed.tick:
        return found("tick", recorded.tick, replayed.tick)
    if exact and recorded.header.stamp != replayed.header.stamp:
        return found("header.stamp", _seconds(recorded), _seconds(replayed))
    for field in comparer.columns:
        then, now = np.atleast_1d(getattr(recorded, field)), np.atleast_1d(getattr(replayed, field))
        if len(then) != len(now):
            return found(f"the number of entries ({field})", len(then), len(now))
        unequal = np.flatnonzero(_unequal(then, now, None if exact else TOLERANCE.get(field)))
        if len(unequal):
            index = int(unequal[0])
            return found(field, repr(then[index].item()), repr(now[index].item()), index)
    return None


def _seconds(message: Any) -> str:
    stamp = message.header.stamp
    return f"{stamp.sec}.{stamp.nanosec:09d} s"


def _unequal(then: NDArray[Any], now: NDArray[Any], tolerance: float | None) -> NDArray[np.bool_]:
    if tolerance is not None:
        near: NDArray[np.bool_] = np.abs(then - now) <= tolerance + RELATIVE * np.abs(then)
        return np.asarray(~near & ~(np.isnan(then) & np.isnan(now)))  # NaN is near NaN only
    if then.dtype.kind == "f":  # as integers: a NaN equals itself, and the two zeros differ
        return np.asarray(then.view(np.uint64) != now.view(np.uint64))
    return np.asarray(then != now)


def outcome_difference(
    tick: int, time: float, recorded: Sequence[Outcome], replayed: Sequence[Outcome]
) -> Difference | None:
    """Compares what became of the commands of one tick. None if it is equal."""
    for then, now in zip(recorded, replayed, strict=False):
        for field in fields(Outcome):
            before, after = getattr(then, field.name), getattr(now, field.name)
            if not _same(before, after):
                part = f"the command {', '.join(then.names)} from {then.source}"
                return Difference(tick, time, "outcomes", field.name, str(before), str(after), part=part)
    if len(recorded) != len(replayed):
        counts = (str(len(recorded)), str(len(replayed)))
        return Difference(tick, time, "outcomes", "the number of outcomes", *counts)
    return None


def _same(before: Any, after: Any) -> bool:
    """Equality in which a NaN, which a refused command may hold, equals itself."""
    if isinstance(before, tuple):
        return len(before) == len(after) and all(map(_same, before, after))
    if isinstance(before, float) and isinstance(after, float) and math.isnan(before):
        return math.isnan(after)
    return bool(before == after)
