# SPDX-License-Identifier: Apache-2.0
"""Some seconds of a recording as bytes: bottles, contacts, belts and signals as differences of whole numbers.

A block is a list of arrays (`packed`), in the order of `pack`. page/block.js reads it, and must be changed
together with this file. Positions in mm, speeds in mm/s, forces in steps of a ninth (`levels`), signals in steps of
1e-4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from conveyor_sim.columns.bottles import BottleColumns, ContactColumns

Integers = NDArray[np.int64]
Floats = NDArray[np.float64]

MM = 1000.0
SIGNAL_STEPS = 1e4
"""Steps in one unit of a signal."""
LEAST_FORCE = 0.05
"""Scale of the least force that is shown, N; much smaller ones have level 0."""
LEVELS = 8.0
"""Steps from a force to twice that."""
UNKNOWN = -(2**40)
"""Represents NaN and values out of range."""
_MOST_BYTES = 10
"""Bytes of a number in a block, at most."""
FORCE_FRAMES = 5
"""Frames that share one peak force."""
SECONDS = 4.0
"""Length of a block in one file, s of simulated time."""


def block_ticks(tick_ns: int, seconds: float = SECONDS) -> int:
    """Return the number of ticks in a block."""
    return max(1, round(seconds * 1e9 / tick_ns))


@dataclass
class BlockContent:
    """Content of a block, in the order of time."""

    bottles: list[tuple[int, BottleColumns]] = field(default_factory=list)
    """Ticks and bottles; peak forces are since the entry before."""
    contacts: list[tuple[int, ContactColumns]] = field(default_factory=list)
    belts: list[tuple[int, Floats]] = field(default_factory=list)
    """Ticks and actual speeds, m/s."""
    signals: list[tuple[int, Floats]] = field(default_factory=list)
    """Ticks and values as they are read, forced ones included; then those of a controller's variables, once known."""


def pack(content: BlockContent, start: int) -> bytes:
    """Return a block that begins at a tick."""
    ids, arrays = _bottles(content.bottles, start)
    arrays += _contacts(content.contacts, content.bottles, ids, start)
    arrays += _columns([(tick, np.round(speeds * MM)) for tick, speeds in content.belts], start)
    arrays += _columns([(tick, np.round(values * SIGNAL_STEPS)) for tick, values in content.signals], start)
    return packed(arrays)


def levels(force: Floats) -> Integers:
    """Return forces (N) as whole numbers on a logarithmic scale, with an error of at most 5 % or LEAST_FORCE."""
    known = np.nan_to_num(np.maximum(force, 0.0))
    return np.round(LEVELS * np.log2(1.0 + known / LEAST_FORCE)).astype(np.int64)


def _bottles(frames: Sequence[tuple[int, BottleColumns]], start: int) -> tuple[Integers, list[Integers]]:
    """Return the ids of all bottles, ascending, and: ticks; id, type, first frame, frame count, x, y, forces per track.

    A track is a bottle of one type over consecutive frames. A bottle that a machine has held in between, or whose type
    has changed, has two tracks.
    """
    ticks = np.array([tick for tick, _ in frames], dtype=np.int64)
    if not frames:
        return ticks, [ticks] * 8
    column = np.concatenate([bottles.id for _, bottles in frames]).astype(np.int64)
    frame = np.repeat(np.arange(len(frames)), [len(bottles.id) for _, bottles in frames])
    # By bottle, then by time, so that neighbouring values are similar.
    order = np.lexsort((frame, column))
    kinds = np.concatenate([bottles.type for _, bottles in frames]).astype(np.int64)[order]
    column, frame = column[order], frame[order]
    changed = (np.diff(column, prepend=-1) != 0) | (np.diff(kinds, prepend=-1) != 0)
    first = np.flatnonzero(changed | (np.diff(frame, prepend=-1) != 1))
    count = np.diff(first, append=len(column))
    x, y, force = (
        np.concatenate([getattr(bottles, name) for _, bottles in frames])[order] for name in ("x", "y", "peak_force")
    )
    slot = frame // FORCE_FRAMES
    begins = np.union1d(first, np.flatnonzero(np.diff(slot, prepend=-1) != 0))
    peaks = np.maximum.reduceat(force, begins) if len(begins) else force
    moves = [_bends(np.round(axis * MM).astype(np.int64), first) for axis in (x, y)]
    steps = differences(levels(peaks))
    ids, types = column[first], kinds[first]
    return np.unique(ids), [differences(ticks - start), differences(ids), types, frame[first], count, *moves, steps]


def _bends(values: Integers, first: Integers) -> Integers:
    """Return each value less its linear extrapolation from the two before. Pieces begin at the places `first`."""
    bends = differences(differences(values))
    second = first[first + 1 < len(values)] + 1
    bends[second] = values[second] - values[second - 1]
    bends[first] = values[first]
    return bends


def _contacts(
    frames: Sequence[tuple[int, ContactColumns]],
    bottles: Sequence[tuple[int, BottleColumns]],
    ids: Integers,
    start: int,
) -> list[Integers]:
    """Return ticks; contacts per tick; place of bottle a; distance to that of b, 0 for a rail; rail points; forces."""
    ticks = np.array([tick for tick, _ in frames], dtype=np.int64)
    counts, firsts, others, points, forces = [], [], [], [], []
    for _, contacts in frames:
        a, b, pair = contacts.a.astype(np.int64), contacts.b.astype(np.int64), contacts.kind == 0
        place, other = (np.searchsorted(ids, bottle) for bottle in (a, b))
        known = (_entries(ids, place) == a) & (~pair | (_entries(ids, other) == b))
        place, other, pair = place[known], other[known], pair[known]
        counts.append(len(place))
        firsts.append(differences(place))
        others.append(np.where(pair, other - place, 0))
        points.append(np.round(np.stack([contacts.x, contacts.y], axis=1)[known][~pair] * MM).astype(np.int64).ravel())
        forces.append(levels(contacts.normal_force[known]))
    lists = (firsts, others, points, forces)
    return [
        differences(ticks - start),
        np.array(counts, dtype=np.int64),
        *(np.concatenate(parts) if parts else np.zeros(0, np.int64) for parts in lists),
    ]


def _entries(ids: Integers, places: Integers) -> Integers:
    """Return the ids at places; the last one for places beyond it, and -1 if there are none."""
    return ids[places.clip(max=len(ids) - 1)] if len(ids) else np.full(len(places), -1)


def _columns(rows: Sequence[tuple[int, Floats]], start: int) -> list[Integers]:
    """Return ticks; then for each column the number of changes, their rows (as differences), and the changes."""
    ticks = np.array([tick for tick, _ in rows], dtype=np.int64)
    if not rows:
        return [ticks] * 4
    table = np.full((len(rows), max(len(values) for _, values in rows)), np.nan)
    for row, (_, values) in zip(table, rows, strict=True):
        row[: len(values)] = values
    strange = ~np.isfinite(table) | (np.abs(table) >= -UNKNOWN)
    table = np.where(strange, UNKNOWN, table).astype(np.int64)
    steps = np.diff(table, axis=0, prepend=np.zeros((1, table.shape[1]), np.int64))
    changed = steps.T != 0
    row = np.nonzero(changed)[1]
    counts = changed.sum(axis=1)
    gaps = differences(row)
    begins = np.cumsum(counts)[:-1]
    begins = np.concatenate([[0], begins])[counts > 0]
    gaps[begins] = row[begins]
    return [differences(ticks - start), counts.astype(np.int64), gaps, steps.T[changed]]


def varints(values: ArrayLike) -> bytes:
    """Return numbers (n,) as bytes of seven bits each, the lowest bits first, the sign in the lowest bit.

    The highest bit of a byte means that more follow, so small numbers take one byte.
    """
    signed = np.asarray(values, dtype=np.int64)
    rest = ((signed << 1) ^ (signed >> 63)).view(np.uint64)
    parts = np.empty((len(rest), _MOST_BYTES), dtype=np.uint8)
    used = np.zeros((len(rest), _MOST_BYTES), dtype=np.bool_)
    used[:, 0] = True
    for place in range(_MOST_BYTES):
        parts[:, place] = rest & np.uint64(0x7F)
        rest = rest >> np.uint64(7)
        more = rest > 0
        if not more.any():
            parts, used = parts[:, : place + 1], used[:, : place + 1]
            break
        parts[more, place] |= 0x80
        used[:, place + 1] = more
    return bytes(parts[used])


def packed(arrays: list[NDArray[np.int64]]) -> bytes:
    """Return arrays as bytes, each after its length."""
    return b"".join(varints([len(array)]) + varints(array) for array in arrays)


def differences(values: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the first value, then each value less the one before."""
    return np.diff(values, prepend=np.int64(0))
