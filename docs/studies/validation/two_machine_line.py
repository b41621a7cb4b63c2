# SPDX-License-Identifier: Apache-2.0
"""Two machines that fail, and the conveyor between them, against the closed form of continuous flow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from validation import two_machines as theory
from validation.source import Case, Range, Row, Run, Source

MACHINE = theory.Machine(between_failures=4.0, to_repair=1.0)
SEEDS = range(10)


def simulate(case: Case) -> Mapping[str, float]:
    """Run a conveyor of one length with one seed."""
    scene = theory.line(float(case["length_m"]), MACHINE, MACHINE, int(case["seed"]))
    return {"efficiency": theory.taken(scene, theory.DURATION) / (theory.RATE * theory.DURATION)}


def rows(runs: Sequence[Run]) -> list[Row]:
    """Compare the efficiency at each length with the closed form."""
    found = []
    for length in theory.LENGTHS:
        closed = theory.conveyor_efficiency(
            MACHINE, MACHINE, theory.RATE, theory.holds(length), theory.transport(length)
        )
        values = [run["efficiency"] for run in runs if run["length_m"] == length]
        simulated = Range.of_mean(values) if values else None
        found.append(Row(f"efficiency, {length:g} m of conveyor", Range.exact(closed), simulated, "closed form"))
    return found


SOURCE = Source(
    name="two_machine_line",
    title="Two machines and a buffer",
    citation=(
        "S. B. Gershwin and I. C. Schick, Operations Research 31, 354 (1983), and earlier work named in "
        "[two_machines.py](studies/validation/two_machines.py)."
    ),
    read=(
        "abstract. The closed form of continuous flow is derived again in the program; a test compares it with a "
        "simulation of the fluid model and with its limits."
    ),
    measured=(
        "throughput of two machines that fail while they work, with exponential times between failures and to repair, "
        "and a finite buffer between them."
    ),
    simulated=(
        "a source and a sink on a conveyor, 4 bottles a second, 4 s between failures, 1 s to repair, 500 s after a "
        "warm-up of 20 s, 10 seeds for each of four lengths."
    ),
    cases=lambda: [{"length_m": length, "seed": seed} for length in theory.LENGTHS for seed in SEEDS],
    simulate=simulate,
    rows=rows,
    seconds=3.0,
)
