# SPDX-License-Identifier: Apache-2.0
"""Impulses through a rebuild of the lists: stored by pair of bottles, or by bottle and rail piece."""

from typing import Any

from conveyor_sim.engine.arrays.impulses import COLOURS, ROW
from conveyor_sim.engine.compiler.compile import fill, kernel, part


@part
def store_pairs(pairs: Any, held: Any) -> None:
    """Copy the rows of pairs, unless a previous attempt with a shorter list has done so."""
    if held is None:
        return
    if held.kept_count[0] >= 0:
        return
    kept = 0
    for p in range(pairs.used[0]):
        row = ROW * held.place[p]
        if _any(held.row, row):
            held.kept_i[kept] = pairs.i[p]
            held.kept_j[kept] = pairs.j[p]
            _copy(held.row, row, held.kept, ROW * kept)
            kept += 1
    held.kept_count[0] = kept


@part
def order_pairs(bottles: Any, pairs: Any, impulses: Any) -> None:
    """Colour the pairs of a rebuilt list in its order, each with the first colour that neither bottle has.

    Then put the rows of pairs that are still listed in their places.
    """
    if impulses is None:
        return
    impulses.anew[0] = 1
    if pairs is not None:
        _colour(bottles, pairs, pairs.impulse, impulses.mask, impulses.types)
        _restore_pairs(pairs, pairs.impulse)


@part
def _colour(bottles: Any, pairs: Any, held: Any, mask: Any, types: int) -> None:
    fill(mask, 0)
    fill(held.start, 0)
    for p in range(pairs.used[0]):
        i, j = pairs.i[p], pairs.j[p]
        taken, colour = mask[i] | mask[j], 0
        while colour < COLOURS - 1 and (taken >> colour) & 1 != 0:
            colour += 1
        mask[i] |= 1 << colour
        mask[j] |= 1 << colour
        held.place[p] = colour
        held.start[colour + 1] += 1
    for colour in range(COLOURS):
        held.start[colour + 1] += held.start[colour]
        held.next[colour] = held.start[colour]
    for p in range(pairs.used[0]):
        i, j, colour = pairs.i[p], pairs.j[p], held.place[p]
        place = held.next[colour]
        held.next[colour] += 1
        held.place[p] = place
        held.i[place] = i
        held.j[place] = j
        held.kind[place] = bottles.type[i] * types + bottles.type[j]


@part
def _restore_pairs(pairs: Any, held: Any) -> None:
    """Put rows back; the list and the copy are sorted by (i, j)."""
    k, kept = 0, held.kept_count[0]
    for p in range(pairs.used[0]):
        i, j = pairs.i[p], pairs.j[p]
        while k < kept and (held.kept_i[k] < i or (held.kept_i[k] == i and held.kept_j[k] < j)):
            k += 1
        if k < kept and held.kept_i[k] == i and held.kept_j[k] == j:
            _copy(held.kept, ROW * k, held.row, ROW * held.place[p])
        else:
            _clear(held.row, ROW * held.place[p])
    held.kept_count[0] = -1


@part
def store_near(near: Any, held: Any) -> None:
    """Copy the rows of contacts with rails, unless a previous attempt with a shorter list has done so."""
    if held is None:
        return
    if held.kept_count[0] >= 0:
        return
    kept = 0
    for i in range(near.start.size - 1):
        for entry in range(near.start[i], near.start[i + 1]):
            if _any(held.row, ROW * entry):
                held.kept_bottle[kept] = i
                held.kept_piece[kept] = near.piece[entry]
                _copy(held.row, ROW * entry, held.kept, ROW * kept)
                kept += 1
    held.kept_count[0] = kept


@part
def restore_near(near: Any, held: Any) -> None:
    """Put the rows of entries that are still listed in their places; list and copy are sorted by bottle."""
    if held is None:
        return
    k, kept = 0, held.kept_count[0]
    for i in range(near.start.size - 1):
        while k < kept and held.kept_bottle[k] < i:
            k += 1
        for entry in range(near.start[i], near.start[i + 1]):
            _clear(held.row, ROW * entry)
            same = k
            while same < kept and held.kept_bottle[same] == i:
                if held.kept_piece[same] == near.piece[entry]:
                    _copy(held.kept, ROW * same, held.row, ROW * entry)
                same += 1
    held.kept_count[0] = -1


@kernel
def drop_pair_impulses(pairs: Any, held: Any, slot: int) -> None:
    """Clear the impulses of a bottle that is removed: another bottle may get its slot before the next rebuild."""
    if held is None:
        return
    for p in range(pairs.used[0]):
        if pairs.i[p] == slot or pairs.j[p] == slot:
            _clear(held.row, ROW * held.place[p])


@kernel
def drop_near_impulses(near: Any, held: Any, slot: int) -> None:
    """Clear the impulses at rails of a bottle that is removed."""
    if held is None:
        return
    for entry in range(near.start[slot], near.start[slot + 1]):
        _clear(held.row, ROW * entry)


@part
def _any(rows: Any, row: int) -> bool:
    return rows[row] != 0.0 or rows[row + 1] != 0.0 or rows[row + 2] != 0.0 or rows[row + 3] != 0.0


@part
def _copy(source: Any, first: int, target: Any, place: int) -> None:
    for number in range(ROW):
        target[place + number] = source[first + number]


@part
def _clear(rows: Any, row: int) -> None:
    for number in range(ROW):
        rows[row + number] = 0.0
