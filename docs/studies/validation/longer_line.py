# SPDX-License-Identifier: Apache-2.0
"""Four machines that fail, and the conveyors between them: the simulated line against decomposition.

No closed form is known for more than two machines. Decomposition approximates the line by one line of two machines per
buffer. The machine before a buffer stands for all that lies upstream, the machine behind it for all that lies
downstream (Gershwin, LIDS-P-1309, 1983; the algorithm of Dallery, David and Xie 1988 for continuous flow and equal
rates).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from conveyor_sim.scene import Scene, parse_scene
from validation import two_machines as theory
from validation.source import Case, Range, Row, Run, Source

Machine = theory.Machine
RATE, SPEED, RADIUS, REGION = theory.RATE, theory.SPEED, theory.RADIUS, theory.REGION
GAP = 0.3
"""Distance from the end of a conveyor to the start of the next, m. Stations carry bottles across."""
SEEDS = range(12)
DURATION = 1000.0
"""s, after `theory.WARM_UP`."""

HEAD = """
name: longer_line
description: Four machines that fail, and three conveyors between them.
duration: 100000.0
seed: {seed}
accuracy: draft
bottle_types: {{bottle: {{radius: {radius}, mass: 0.1, material: glass}}}}
contacts:
  - {{between: [glass, glass], stiffness: 5000.0, damping: {{law: normal, restitution: 0.3}}}}
  - {{between: [glass, steel], stiffness: 5000.0, damping: {{law: normal, restitution: 0.3}}}}
base: [{{between: [glass, chain], friction: 0.3}}]
outputs: {{bottles: 0.0, poses: 0.0, contacts: 0.0, belts: 0.0, signals: 0.0}}
"""

BELT = (
    "  lane_{i}: {{kind: straight, start: [{behind}, -0.05], angle: 0.0, length: {whole}, width: 0.1, "
    "speed: {speed}, material: chain}}"
)
RAILS = """
  left_{i}: {{kind: segment, from: [{behind}, 0.032], to: [{end}, 0.032], material: steel}}
  end_{i}: {{kind: segment, from: [{end}, 0.032], to: [{end}, -0.032], material: steel}}
  right_{i}: {{kind: segment, from: [{end}, -0.032], to: [{behind}, -0.032], material: steel}}
"""
PLACE = "position: [{x}, 0.0], direction: 0.0, speed: {speed}"
TAKE = "region: [[{reach}, -0.05], [{end}, -0.05], [{end}, 0.05], [{reach}, 0.05]]"


def decomposition(machines: Sequence[Machine], rate: float, buffers: Sequence[float]) -> float:
    """Return throughput over `rate` (1/s, of all machines) with room for `buffers` bottles between n machines.

    buffers: n - 1 values. Each buffer i has a line of two machines, u(i) before and d(i) behind it. Three conditions
    fix their rates: conservation of flow; the relation of flow and idle time,

        l_u(i)/r_u(i) + l_d(i-1)/r_d(i-1) = 1/E(i-1) + 1/e(i) - 2,

    with E(i) the efficiency of line i and e(i) that of machine i alone; and the resumption of flow: u(i) is down
    because machine i failed, or, in the share ps(i-1) / (E(i-1) l_u(i)/r_u(i)), because buffer i-1 is empty. It then
    resumes at the rate of u(i-1). Downstream the same holds mirrored.
    """
    last = len(buffers)
    up, down = list(machines[:-1]), list(machines[1:])

    def line(i: int) -> theory.Balance:
        return theory.balance(up[i], down[i], rate, buffers[i])

    while True:
        before = line(0).efficiency
        for i in range(1, last):
            flow, idle = line(i - 1), down[i - 1]
            up[i] = _pseudo(machines[i], idle, up[i - 1], flow.efficiency, flow.starved)
        for i in range(last - 2, -1, -1):
            flow, idle = line(i + 1), up[i + 1]
            down[i] = _pseudo(machines[i + 1], idle, down[i + 1], flow.efficiency, flow.blocked)
        if math.isclose(line(0).efficiency, before, rel_tol=1e-12):
            return before


def _pseudo(machine: Machine, other: Machine, beyond: Machine, efficiency: float, waits: float) -> Machine:
    """Return the machine that stands for `machine` and all beyond the neighbouring buffer.

    other: machine of the neighbouring line at the same place; beyond: its machine at the far side of the buffer.
    waits: share of time in which that buffer stops `machine`.
    """
    down_per_up = 1.0 / efficiency + 1.0 / machine.alone - 2.0 - other.to_repair / other.between_failures
    waiting = waits / (down_per_up * efficiency)
    resumes = waiting / beyond.to_repair + (1.0 - waiting) / machine.to_repair
    return Machine(between_failures=1.0 / (resumes * down_per_up), to_repair=1.0 / resumes)


def line(lengths: Sequence[float], machines: Sequence[Machine], seed: int) -> Scene:
    """Build conveyors of some lengths (m) between machines, of which there is one more."""
    belts, rails, devices, start = ["belts:"], ["rails:"], ["machines:"], 0.0
    take = "kind: source, bottle: bottle"
    for i, length in enumerate(lengths):
        end = start + length
        place = {"i": i, "behind": start - 0.2, "end": end, "whole": length + 0.2, "speed": SPEED}
        belts.append(BELT.format(**place))
        rails.append(RAILS.format(**place))
        devices.append(_machine(i, f"{take}, {PLACE.format(x=start, speed=SPEED)}", machines[i]))
        take = f"kind: station, {TAKE.format(reach=end - REGION, end=end)}"
        start = end + GAP
    devices.append(_machine(len(lengths), take.replace("station", "sink"), machines[-1]))
    return parse_scene(HEAD.format(seed=seed, radius=RADIUS) + "\n".join([*belts, *rails, *devices]))


def _machine(number: int, fields: str, machine: Machine) -> str:
    return f"  m{number}: {{{fields}, rate: {RATE}, failures: {{breakdown: {theory.breakdown(machine)}}}}}"


LINES: dict[str, tuple[tuple[float, ...], tuple[Machine, ...]]] = {
    "equal machines": ((1.0, 1.0, 1.0), (Machine(4.0, 1.0),) * 4),
    "unequal": ((1.6, 1.0, 1.3), (Machine(6.0, 1.0), Machine(9.0, 1.5), Machine(4.0, 0.8), Machine(12.0, 2.0))),
}
"""Lengths of the conveyors (m) and machines of each line."""


def expected(lengths: Sequence[float], machines: Sequence[Machine]) -> float:
    """Return the efficiency by decomposition. Bottles in transit buffer nothing, as in `two_machines.py`."""
    room = [theory.holds(length) - RATE * theory.transport(length) for length in lengths]
    return decomposition(machines, RATE, room)


def simulate(case: Case) -> Mapping[str, float]:
    """Run a line with one seed."""
    lengths, machines = LINES[str(case["line"])]
    scene = line(lengths, machines, int(case["seed"]))
    return {"efficiency": theory.taken(scene, DURATION) / (RATE * DURATION)}


def rows(runs: Sequence[Run]) -> list[Row]:
    """Compare the efficiency of each line with the decomposition."""
    return [
        Row(
            f"efficiency, {name}",
            Range.exact(expected(*LINES[name])),
            Range.of_mean(values) if (values := [run["efficiency"] for run in runs if run["line"] == name]) else None,
            "algorithm",
        )
        for name in LINES
    ]


SOURCE = Source(
    name="longer_line",
    title="Lines of four machines by decomposition",
    citation=(
        "S. B. Gershwin, *An efficient decomposition method for the approximate evaluation of tandem queues with "
        "finite storage space and blocking*, LIDS-P-1309 (1983); Y. Dallery, R. David and X.-L. Xie, IIE Transactions "
        "20, 280 (1988), for the algorithm with continuous flow."
    ),
    read=(
        "abstract of LIDS-P-1309; its tables could not be read. The equations are derived again in the program, and a "
        "test compares them with a simulation of the fluid model."
    ),
    measured=(
        "throughput of a line of machines that fail while they work, with exponential times between failures and to "
        "repair, and a finite buffer between any two."
    ),
    simulated=(
        "a source, two stations and a sink on three conveyors, 4 bottles a second, 1000 s after a warm-up of 20 s, "
        "12 seeds for each of two lines. A conveyor buffers its capacity less the bottles in transit."
    ),
    cases=lambda: [{"line": name, "seed": seed} for name in LINES for seed in SEEDS],
    simulate=simulate,
    rows=rows,
    seconds=10.0,
    discussion=(
        "Decomposition is an approximation: for these lines it is up to 1 % above a simulation of the fluid model. "
        "The intervals of the simulated lines are as wide as that."
    ),
)
