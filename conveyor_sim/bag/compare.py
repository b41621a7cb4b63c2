# SPDX-License-Identifier: Apache-2.0
"""First difference of two messages of one tick, bit for bit or within a tolerance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.bag.messages.encode import Outcome
from conveyor_sim.bag.messages.topics import COMPARED

RELATIVE = 1e-6
"""Relative tolerance, added to the absolute tolerance of a field (topics.Compare)."""


@dataclass(frozen=True)
class ReplayDifference:
    """First difference of a replay from its recording."""

    tick: int
    time: float
    """s"""
    topic: str
    field: str
    recorded: str
    replayed: str
    bottle: int | None = None
    """Id, if the field belongs to a bottle; for a contact: its bottle a."""
    part: str = ""
    """Entry in words: "bottle 17", "belt feeder"."""

    def __str__(self) -> str:
        part = f" of {self.part}" if self.part else ""
        return (
            f"tick {self.tick} ({self.time:.4f} s), topic {self.topic}: {self.field}{part} "
            f"was recorded as {self.recorded} and replayed as {self.replayed}"
        )


def first_difference(topic: str, line: Any, recorded: Any, replayed: Any, *, exact: bool) -> ReplayDifference | None:
    """Compare two decoded messages; `replayed` gives the tick and names the entries. Return None if they are equal."""
    row = COMPARED[topic]
    compare = row.compare
    tick = int(replayed.tick)
    time = tick * line.tick_ns * 1e-9

    def difference(field: str, then: object, now: object, index: int | None = None) -> ReplayDifference:
        bottle = None if index is None or compare.bottle is None else int(getattr(replayed, compare.bottle)[index])
        part = "" if index is None else compare.entry(line, replayed, index)
        return ReplayDifference(tick, time, topic, field, str(then), str(now), bottle, part)

    if recorded.tick != replayed.tick:
        return difference("tick", recorded.tick, replayed.tick)
    if exact and _seconds(recorded) != _seconds(replayed):
        return difference("header.stamp", _seconds(recorded), _seconds(replayed))
    for field in row.fields:
        then, now = _entries(getattr(recorded, field)), _entries(getattr(replayed, field))
        if len(then) != len(now):
            return difference(f"the number of entries ({field})", len(then), len(now))
        unequal = np.flatnonzero(_unequal(then, now, None if exact else compare.within.get(field)))
        if len(unequal):
            index = int(unequal[0])
            return difference(field, repr(then[index].item()), repr(now[index].item()), index)
    return None


def _entries(values: Any) -> NDArray[Any]:
    """Return the entries of a field: numbers or texts; of a list of AlarmIds, the ids of each as one text."""
    is_ids = isinstance(values, list) and values and is_dataclass(values[0])
    return np.atleast_1d([str(list(one.ids)) for one in values] if is_ids else values)


def _seconds(message: Any) -> str:
    """Return the stamp as a text with all its digits."""
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
    tick: int, time: float, recorded: Sequence[Outcome], replayed: Sequence[Outcome], *, exact: bool
) -> ReplayDifference | None:
    """Compare the results of the commands of one tick. Return None if they are equal.

    exact: also compare the reasons of refusals, which another version may word differently.
    """
    names = [field.name for field in fields(Outcome) if exact or field.name != "reason"]
    for then, now in zip(recorded, replayed, strict=False):
        for name in names:
            before, after = getattr(then, name), getattr(now, name)
            if not _same(before, after):
                part = f"the command {', '.join(then.names)} from {then.source}"
                return ReplayDifference(tick, time, "outcomes", name, str(before), str(after), part=part)
    if len(recorded) != len(replayed):
        counts = (str(len(recorded)), str(len(replayed)))
        return ReplayDifference(tick, time, "outcomes", "the number of outcomes", *counts)
    return None


def _same(before: Any, after: Any) -> bool:
    """Return True if two values are equal. A NaN, which a refused command may hold, equals itself."""
    if isinstance(before, tuple):
        return len(before) == len(after) and all(map(_same, before, after))
    if isinstance(before, float) and isinstance(after, float) and math.isnan(before):
        return math.isnan(after)
    return bool(before == after)
