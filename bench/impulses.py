# SPDX-License-Identifier: Apache-2.0
"""The method of impulses on the dense table of glass: bottles times real time on one core, overlaps, errors of forces.

Speeds are those of processor time, so other work on the machine matters little. Forces are compared with explicit steps
(leapfrog) from one state at rest: the other settings start without impulses and settle for SETTLE. Box2D and pymunk run
the same bottles from the same state, pulled by gravity in their plane; they give overlaps, but no forces. The ratio of
two threads to one is that of wall time.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench import box2d_rival, ours, pymunk_rival
from bench.box2d_rival import Box2D
from bench.discs import Discs, largest_overlap
from bench.markdown import table as markdown
from bench.measure import Effort, say
from bench.packed import FRICTION, GRAVITY, MASS, TICK, box_for
from bench.packed import table as dense_table
from bench.pymunk_rival import Pymunk
from bench.rows import Row, Rows
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

CASE = "impulses"
SIZES, QUICK_SIZES = (1_000, 10_000), (100,)
COMPARED = 1_000
"""Most bottles whose forces are compared: with more, explicit steps take hours."""
SETTINGS = ((8, 1), (8, 2), (16, 1), (16, 2))
"""Steps per tick and sweeps in a step."""
STIFFNESS, RESTITUTION = 1e8, 0.5
EXPLICIT = "leapfrog, 20 steps a contact"
EXPLICIT_STEPS = math.ceil(TICK / (math.pi * math.sqrt(0.5 * MASS / STIFFNESS) / 20.0))
PACKING, REST, SETTLE, SHOWN = 4.0, 2.0, 1.0, 25
"""s of packing by impulses, of the explicit reference, and of the others from its state; ticks over which forces are
averaged."""
PRESSED = 3.0
"""s from the explicit state until overlaps are taken: those of soft contacts grow for seconds."""
PIECE = 0.1
"""s of simulated time between two readings of the clock."""
THREADS = (8, 2)
"""Setting that runs on two threads, and on a number of threads chosen by itself."""
SPEED = "bottles x real time"
TWO, CHOSEN = "2 threads / 1, by wall time", "threads chosen by itself / 1, by wall time"
OVERLAP = "largest overlap, mm"
FORCES = "RMS error of single forces"
WALL = "force on the end wall / sum of mu m g"


def name_of(steps: int, sweeps: int) -> str:
    """Return the name of a setting."""
    return f"impulses, {steps} x {sweeps}"


def glass(count: int, accuracy: dict[str, Any], stiffness: float = STIFFNESS) -> Scene:
    """Build the dense table of glass bottles with a choice of steps. stiffness: between bottles, N/m."""
    laws = {"damping": {"law": "normal", "restitution": RESTITUTION}, "friction": 0.1}
    contacts = [
        {"between": ["bottle", other], "stiffness": k, **laws}
        for other, k in (("bottle", stiffness), ("rail", 2.0 * stiffness))
    ]
    # The speed is that of bottles which are stepped.
    return dense_table(count, "paper", contacts=contacts, accuracy=accuracy, effects={"sleeping": "off"})


def swept(count: int, steps: int, sweeps: int) -> Scene:
    """Build that table with integrator impulses."""
    return glass(count, {"integrator": "impulses", "per_tick": steps, "sweeps": sweeps})


def measure(effort: Effort) -> list[Row]:
    """All quantities of all settings."""
    return [row for count in (QUICK_SIZES if effort.quick else SIZES) for row in _one_size(count, effort)]


def _one_size(count: int, effort: Effort) -> list[Row]:
    say(f"impulses, {count} bottles: packing them")
    start = ours.packed(swept(count, 16, 2), 0.1 if effort.quick else PACKING, 1)
    explicit = Simulation(glass(count, {"per_tick": EXPLICIT_STEPS}), threads=1)
    explicit.restore_from(start)
    compares = count <= COMPARED
    say(f"impulses, {count} bottles: the explicit reference")
    explicit.advance(round((REST if compares and not effort.quick else TICK) / TICK))
    reference, pushed = forces(explicit) if compares else ({}, math.nan)
    simulations = {name_of(*setting): Simulation(swept(count, *setting), threads=1) for setting in SETTINGS}
    drag = count * FRICTION * MASS * GRAVITY
    rows = [Row(CASE, count, EXPLICIT, WALL, 0, pushed / drag)] if compares else []
    rivals = _rivals(count, ours.state_of(explicit, box_for(count)))
    for name, simulation in simulations.items():
        say(f"impulses, {count} bottles: {name} settles")
        simulation.restore_from(explicit)
        simulation.advance(round(SETTLE / TICK))
        now, pushed = forces(simulation)
        if compares:
            rows.append(Row(CASE, count, name, FORCES, 0, error(now, reference)))
        rows.append(Row(CASE, count, name, WALL, 0, pushed / drag))
    everybody: dict[str, Discs] = {**{name: _Ours(one) for name, one in simulations.items()}, **rivals}
    for name, discs in everybody.items():
        say(f"impulses, {count} bottles: {name} is pressed")
        discs.advance(PRESSED if name in rivals else PRESSED - SETTLE - SHOWN * TICK)
        rows.append(Row(CASE, count, name, OVERLAP, 0, 1e3 * largest_overlap(discs.positions(), box_for(count))))
    for turn in range(effort.rounds):
        say(f"impulses, {count} bottles: round {turn + 1}")
        for name, discs in {**everybody, EXPLICIT: _Ours(explicit)}.items():
            seconds = TICK if name == EXPLICIT else PIECE
            began = time.process_time()
            discs.advance(seconds)
            used = time.process_time() - began
            rows.append(Row(CASE, count, name, SPEED, turn, count * seconds / used))
    return rows + _on_threads(count, simulations[name_of(*THREADS)], effort)


class _Ours:
    """A simulation that is measured as the rivals are."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation

    def advance(self, seconds: float) -> None:
        """Take whole ticks over `seconds`."""
        self._simulation.advance(round(seconds / TICK))

    def positions(self) -> NDArray[np.float64]:
        """Axes, (N, 2), m."""
        bottles = self._simulation.bottles()
        return np.column_stack([bottles.x, bottles.y])


def _rivals(count: int, start: ours.PackedState) -> dict[str, Discs]:
    """Return those that are installed, by name."""
    rivals: dict[str, Discs] = {}
    if absent := box2d_rival.why_not():
        say(f"Box2D is left out: {absent}")
    else:
        rivals |= {str(tuning): Box2D(start, tuning) for tuning in box2d_rival.TUNINGS}
    if absent := pymunk_rival.why_not():
        say(f"pymunk is left out: {absent}")
    else:
        # Many steps of pymunk with 10 000 bottles take minutes.
        tunings = pymunk_rival.TUNINGS[: None if count <= COMPARED else 1]
        rivals |= {str(tuning): Pymunk(start, tuning) for tuning in tunings}
    return rivals


def _on_threads(count: int, start: Simulation, effort: Effort) -> list[Row]:
    """Return the ratios of wall times with one thread to those with two, and with a number chosen by itself."""
    say(f"impulses, {count} bottles: threads")
    runs = {threads: Simulation(swept(count, *THREADS), threads=threads) for threads in (1, 2, None)}
    for simulation in runs.values():
        simulation.restore_from(start)
        simulation.advance(round(SETTLE / TICK))
    rows = []
    for turn in range(effort.rounds):
        walls = {}
        for threads, simulation in runs.items():
            began = time.perf_counter()
            simulation.advance(round(PIECE / TICK))
            walls[threads] = time.perf_counter() - began
        rows.append(Row(CASE, count, name_of(*THREADS), TWO, turn, walls[1] / walls[2]))
        rows.append(Row(CASE, count, name_of(*THREADS), CHOSEN, turn, walls[1] / walls[None]))
    return rows


def forces(simulation: Simulation) -> tuple[dict[tuple[int, int, int], float], float]:
    """Return means over SHOWN ticks: normal force (N) of each contact, by kind and ends; force of all rails along the
    belt, N, friction at the side walls included."""
    sums: dict[tuple[int, int, int], float] = {}
    along = 0.0
    for _ in range(SHOWN):
        simulation.advance(1)
        contacts = simulation.contacts()
        for key, force in zip(
            zip(contacts.kind.tolist(), contacts.a.tolist(), contacts.b.tolist(), strict=True),
            contacts.normal_force.tolist(),
            strict=True,
        ):
            sums[key] = sums.get(key, 0.0) + force / SHOWN
        pushes = contacts.normal_force * contacts.nx + contacts.tangential_force * contacts.ny
        along += float(np.sum(pushes[contacts.kind == 1])) / SHOWN
    return sums, along


def error(own: dict[tuple[int, int, int], float], reference: dict[tuple[int, int, int], float]) -> float:
    """Return the RMS difference of all contacts over the RMS force of the reference."""
    keys = own.keys() | reference.keys()
    squares = sum((own.get(key, 0.0) - reference.get(key, 0.0)) ** 2 for key in keys)
    return math.sqrt(squares / sum(force**2 for force in reference.values()))


def tables(rows: Rows) -> str:
    """One table: settings by row, quantities of each size by column."""
    sizes = rows.ns(CASE)
    columns = [(n, quantity) for n in sizes for quantity in (SPEED, OVERLAP, WALL, FORCES, TWO, CHOSEN)]
    columns = [(n, q) for n, q in columns if any(rows.values(CASE, n, name, q) for name in rows.contestants(CASE))]
    head = ["", *(f"N = {n:.0f}: {quantity}" for n, quantity in columns)]
    body = [[name, *(_shown(rows, n, name, quantity) for n, quantity in columns)] for name in rows.contestants(CASE)]
    return "\n\n".join(
        [
            "Glass, k = 1e8 N/m, e = 0.5, pressed against the end wall; by processor time of one core. Forces after "
            f"{SETTLE:g} s from a start without impulses, against explicit steps; overlaps after {PRESSED:g} s. Box2D "
            "and pymunk have rigid discs, pulled by gravity in their plane; their first lines are near their defaults.",
            markdown(head, body),
        ]
    )


def _shown(rows: Rows, n: float, name: str, quantity: str) -> str:
    spread = rows.spread(CASE, n, name, quantity)
    return "" if spread is None else f"{spread.middle:.3g}"
