# SPDX-License-Identifier: Apache-2.0
"""Impulses through a rebuild of the lists: stored by pair of bottles, or by bottle and rail piece."""

from typing import Any

from conveyor_sim.engine.arrays.impulses import COLOURS, GROUPS, ROW
from conveyor_sim.engine.compiler.compile import fill, kernel, part
from conveyor_sim.engine.impulses.meeting import mark_met, wake_marked
from conveyor_sim.engine.impulses.runs import plan_runs


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
        _colour(bottles, pairs, pairs.impulse, impulses)
        _restore_pairs(pairs, pairs.impulse)
        _wake_met(bottles, pairs, impulses, impulses.sleep)


@part
def _wake_met(bottles: Any, pairs: Any, impulses: Any, sleep: Any) -> None:
    """Wake islands that a bottle will touch before the lists are rebuilt again, if a tick has begun."""
    if sleep is None:
        return
    if sleep.ahead[0] == 0.0 or sleep.sleepers[0] == 0:
        return
    fill(sleep.mark, 0)
    mark_met(bottles, pairs, sleep, sleep.ahead[0])
    if wake_marked(bottles, impulses, sleep):
        group_pairs(bottles, pairs, impulses)
        plan_runs(bottles, sleep)


@part
def group_pairs(bottles: Any, pairs: Any, impulses: Any) -> None:
    """Put the pairs of two sleepers behind the others of their colour, and awake ones in their places."""
    if pairs is not None:
        store_pairs(pairs, pairs.impulse)
        _colour(bottles, pairs, pairs.impulse, impulses)
        _restore_pairs(pairs, pairs.impulse)


@part
def _colour(bottles: Any, pairs: Any, held: Any, impulses: Any) -> None:
    """Colour the pairs of a list. Put those of a colour in the order of groups: kinds of contact, then sleepers."""
    mask, group_of, kinds = impulses.mask, impulses.group, 0
    fill(mask, 0)
    fill(group_of, -1)
    fill(held.next, 0)
    for p in range(pairs.used[0]):
        i, j = pairs.i[p], pairs.j[p]
        taken, colour = mask[i] | mask[j], 0
        while colour < COLOURS - 1 and (taken >> colour) & 1 != 0:
            colour += 1
        mask[i] |= 1 << colour
        mask[j] |= 1 << colour
        kind = _kind(bottles, impulses, i, j)
        if group_of[kind] < 0:
            group_of[kind] = min(kinds, GROUPS - 2)
            kinds += 1
        group = GROUPS - 1 if _both_sleep(impulses.sleep, i, j) else group_of[kind]
        held.place[p] = GROUPS * colour + group
        held.next[held.place[p]] += 1
    _start_groups(held, impulses.sleep)
    for p in range(pairs.used[0]):
        i, j, place = pairs.i[p], pairs.j[p], held.next[held.place[p]]
        held.next[held.place[p]] += 1
        held.place[p] = place
        held.i[place] = i
        held.j[place] = j
        held.kind[place] = _kind(bottles, impulses, i, j)


@part
def _kind(bottles: Any, impulses: Any, i: int, j: int) -> int:
    return bottles.type[i] * impulses.types + bottles.type[j]


@part
def _both_sleep(sleep: Any, i: int, j: int) -> bool:
    if sleep is None:
        return False
    return sleep.asleep[i] != 0 and sleep.asleep[j] != 0


@part
def _start_groups(held: Any, sleep: Any) -> None:
    """Turn the numbers of pairs in `next` into the first place of each group."""
    total = 0
    for colour in range(COLOURS):
        held.start[colour] = total
        for group in range(GROUPS):
            if group == GROUPS - 1:
                _end_awake(sleep, colour, total)
            count = held.next[GROUPS * colour + group]
            held.next[GROUPS * colour + group] = total
            total += count
    held.start[COLOURS] = total


@part
def _end_awake(sleep: Any, colour: int, end: int) -> None:
    if sleep is not None:
        sleep.end[colour] = end


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
