# SPDX-License-Identifier: Apache-2.0
"""Two labellers of a brewery, whose times to repair follow Weibull distributions, at the level of a line."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from conveyor_sim import Simulation
from conveyor_sim.scene import Scene, parse_scene
from validation import two_machines as theory
from validation.source import Case, Range, Row, Run, Source

LABELLERS = {"labeller 111": (0.83029, 36.428), "labeller 112": (0.78302, 28.755)}
"""Shape and scale of the times to repair, the scale in minutes. A second of the simulation stands for a minute."""
MINUTE = 0.2
"""s of the simulation that stand for a minute of the source, so that many failures fit into a run."""
BETWEEN = 40.0
"""Mean running time between failures, min; chosen here, because the source's values could not be read."""
LENGTH = 0.7
"""Length of the conveyor, m."""
DURATION = 2000.0
"""s, after `theory.WARM_UP`."""
SEEDS = range(6)


def mean_repair(name: str) -> float:
    """Return the mean time to repair of a labeller in minutes: scale x Gamma(1 + 1/shape)."""
    shape, scale = LABELLERS[name]
    return scale * math.gamma(1.0 + 1.0 / shape)


def scene(name: str, seed: int) -> Scene:
    """Build a conveyor from a source that never fails to a labeller."""
    repair = f"{{kind: weibull, mean: {MINUTE * mean_repair(name)}, shape: {LABELLERS[name][0]}}}"
    text = theory.LINE.format(
        rate=theory.RATE,
        speed=theory.SPEED,
        seed=seed,
        radius=theory.RADIUS,
        length=LENGTH,
        whole=LENGTH + 0.2,
        reach=LENGTH - theory.REGION,
        first=theory.breakdown(theory.Machine(1e9, 1.0)),
        second=f"{{between: {{kind: exponential, mean: {MINUTE * BETWEEN}}}, repair: {repair}}}",
    )
    return parse_scene(text)


def simulate(case: Case) -> Mapping[str, float]:
    """Run a line with one labeller and one seed, then let it run empty."""
    simulation = Simulation(scene(str(case["labeller"]), int(case["seed"])), threads=1)
    tick = simulation.scene.tick
    simulation.advance(round(theory.WARM_UP / tick))
    before = simulation.counts.removed
    simulation.advance(round(DURATION / tick))
    taken = simulation.counts.removed - before
    figures = simulation.line.counters()
    assert figures is not None, "sources and sinks count"
    row = list(figures.name).index("machines/second")
    simulation.command(["machines/first/run"], [False])
    while simulation.counts.present:
        simulation.advance(round(1.0 / tick))
    return {
        "efficiency": taken / (theory.RATE * DURATION),
        "mttr_min": float(figures.mttr[row]) / MINUTE,
        "failures": float(figures.failures[row]),
        "fed": simulation.counts.fed,
        "removed": simulation.counts.removed,
    }


def rows(runs: Sequence[Run]) -> list[Row]:
    """Compare mean repairs, the efficiency and the balance of bottles with what the source states or implies."""
    found = []
    for name in LABELLERS:
        of = [run for run in runs if run["labeller"] == name]
        repair = Range.exact(mean_repair(name))
        alone = Range.exact(BETWEEN / (BETWEEN + mean_repair(name)))
        measured = [Range.of_mean([run[key] for run in of]) if of else None for key in ("mttr_min", "efficiency")]
        found.append(Row(f"{name}: mean time to repair, min", repair, measured[0], "from the table's parameters"))
        found.append(Row(f"{name}: efficiency", alone, measured[1], "closed form with that mean"))
    ratio = Range.exact(sum(run["removed"] for run in runs) / sum(run["fed"] for run in runs)) if runs else None
    found.append(Row("bottles out / bottles in", Range.exact(1.0), ratio, "text: all 239 038 bottles come out"))
    return found


SOURCE = Source(
    name="labellers",
    title="Labellers of a brewery with Weibull repairs",
    citation="A thesis on a brewery's packaging line in Plant Simulation (1library.co, article oy87r5zr).",
    read=(
        "an excerpt with the repair times of two labellers and the check of the model. Times between failures, machine "
        "rates, conveyors and the line's efficiency are in parts that could not be read."
    ),
    measured=(
        "times to repair of at least five minutes in the plant's records, fitted by Weibull distributions; all 239 038 "
        "bottles that entered the model of one labeller left it. The unit of the scale is taken to be the minute."
    ),
    simulated=(
        "a source that never fails, 0.7 m of conveyor, and a sink that fails as the labeller. A minute is 0.2 s. The "
        "mean time between failures is chosen here: 40 min. 2000 s, 6 seeds for each labeller."
    ),
    cases=lambda: [{"labeller": name, "seed": seed} for name in LABELLERS for seed in SEEDS],
    simulate=simulate,
    rows=rows,
    seconds=12.0,
    discussion=(
        "This compares the drawing and counting of failures, and the loss of throughput that follows, not the plant: "
        "for that, times between failures and rates of all machines, capacities of the conveyors and the line's "
        "efficiency would have to be published together. Grolsch's canning line reached a machine efficiency of 86 % "
        "against a target of 95 %, because its filler was starved and blocked (P. Scholten, 2016, from the summary). "
        "Its rates and buffers could not be read either, so no line is compared with it."
    ),
)
