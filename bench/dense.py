# SPDX-License-Identifier: Apache-2.0
"""The dense table: our engine against LAMMPS, all pairs in NumPy and a half list in numba, from one packed state."""

from __future__ import annotations

from itertools import product

from bench import lammps_rival, ours
from bench.all_pairs import AllPairs
from bench.half_list import HalfList
from bench.lammps_rival import Lammps
from bench.markdown import table as markdown
from bench.measure import RATE, Effort, in_turns, say
from bench.packed import EFFECTS, TICK, box_for
from bench.packed import table as dense_table
from bench.rows import Row, Rows
from conveyor_sim.simulation import Simulation

CASE = "dense"
SIZES = (100, 1_000, 10_000, 100_000)
QUICK_SIZES = (100, 1_000)
SETTLE, SETTLE_SHORT = 1.2, 0.3
"""s; the short one for 100 000 bottles, whose contacts are 95 % closed by then."""
HANDED_OVER = 0.1
"""s, until the laws are at home in a state that another reached."""
MOST_ALL_PAIRS = 1_000
"""Bottles; arrays of 10 000 x 10 000 take gigabytes."""

LAMMPS, ALL_PAIRS, HALF_LIST = "LAMMPS", "NumPy all pairs", "numba half list"
CONTACTS = "contacts per bottle"
SAME_BITS = "same bits as on one thread"
"""1: yes, 0: no; from the packed state on, or in `everything` from the start."""


def name_of(effects: str, threads: int) -> str:
    """Return the name of this project's engine as a contestant."""
    return f"{effects}, {threads} thread{'s' * (threads > 1)}"


def measure(effort: Effort) -> list[Row]:
    """RATE of all, with contacts per bottle before and whether threads agree."""
    if absent := lammps_rival.why_not():
        say(f"LAMMPS is left out: {absent}")
    return [row for n in (QUICK_SIZES if effort.quick else SIZES) for row in _one_size(n, effort, not absent)]


def _one_size(n: int, effort: Effort, lammps: bool) -> list[Row]:
    say(f"dense, {n} bottles: packing them")
    settle = SETTLE if n < SIZES[-1] else SETTLE_SHORT
    simulations = {key: ours.simulate(dense_table(n, key[0]), key[1]) for key in product(EFFECTS, (1, 2))}
    presser = ours.packed(dense_table(n, "minimal"), settle, threads=2)
    for (effects, threads), simulation in simulations.items():
        if effects == "everything":  # other bottles, and some are fed: it has to pack its own
            ours.press(simulation, settle)
        else:
            simulation.restore_from(presser)
            simulation.advance(round(HANDED_OVER / TICK))
        say(f"dense, {n} bottles: {name_of(effects, threads)} is packed")
    start = ours.state_of(presser, box_for(n))
    contestants = [ours.contestant(name_of(*key), simulation, n) for key, simulation in simulations.items()]
    contestants.append(HalfList(start).contestant())
    if n <= MOST_ALL_PAIRS:
        contestants.append(AllPairs(start).contestant())
    rows = [_same_bits(n, effects, simulations) for effects in EFFECTS]
    rows += [Row(CASE, n, name_of(*key), CONTACTS, 0, ours.contacts_per_bottle(s)) for key, s in simulations.items()]
    if lammps:
        rival = Lammps(start)
        contestants.append(rival.contestant())
        rows.append(Row(CASE, n, LAMMPS, CONTACTS, 0, rival.contacts_per_bottle()))
    say(f"dense, {n} bottles: {len(contestants)} contestants, {effort.rounds} rounds")
    rows += in_turns(contestants, effort, CASE)
    # They go on moving: that they were packed to the end shows after it.
    rows += [Row(CASE, n, name_of(*key), CONTACTS, 1, ours.contacts_per_bottle(s)) for key, s in simulations.items()]
    if lammps:
        rows.append(Row(CASE, n, LAMMPS, CONTACTS, 1, rival.contacts_per_bottle()))
        rival.close()
    return rows


def _same_bits(n: int, effects: str, simulations: dict[tuple[str, int], Simulation]) -> Row:
    one, two = (simulations[effects, threads] for threads in (1, 2))
    return Row(CASE, n, name_of(effects, 2), SAME_BITS, 0, float(one.state_hash() == two.state_hash()))


def tables(rows: Rows) -> str:
    """Ratios, then rates, then contacts."""
    sizes = rows.ns(CASE)
    rivals = [name for name in (LAMMPS, ALL_PAIRS, HALF_LIST) if name in rows.contestants(CASE)]
    ratios = [(name_of(effects, 1), rival) for effects in reversed(EFFECTS) for rival in rivals]
    threads = [(name_of(effects, 2), name_of(effects, 1)) for effects in EFFECTS]
    head = ["", *(f"N = {n:,.0f}".replace(",", " ") for n in sizes)]
    body = [
        [f"{one} / {other}", *(rows.ratio(CASE, n, one, other, RATE) for n in sizes)] for one, other in ratios + threads
    ]
    rates = [[name, *(rows.spread(CASE, n, name, RATE) for n in sizes)] for name in rows.contestants(CASE)]
    packing = [
        [name, *(rows.spread(CASE, n, name, CONTACTS) for n in sizes)]
        for name in rows.contestants(CASE)
        if any(rows.values(CASE, n, name, CONTACTS) for n in sizes)
    ]
    same = all(row.value == 1.0 for row in rows.all if row.quantity == SAME_BITS)
    return "\n\n".join(
        [
            "Ratios of rates, round by round: median (least to greatest).",
            markdown(head, body),
            "Rates, million bottle-steps a second.",
            markdown(head, rates),
            "Contacts per bottle when it was timed; all but `everything` start from one packed state.",
            markdown(head, packing),
            f"Two threads gave {'the same bits as one' if same else 'OTHER BITS than one'} before that.",
        ]
    )
