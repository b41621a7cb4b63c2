# SPDX-License-Identifier: Apache-2.0
"""Cost of settings: processor time per simulated second, from repeats in turns."""

import time
from collections.abc import Callable, Mapping
from statistics import median

from conveyor_sim.accuracy.results import Cost
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.simulation import Simulation

CHUNK = 0.03
"""s that one measurement takes at least: long against a switch of tasks."""

SPAN = 0.1
"""s, simulated, that is run over and over: from the same state on, for every setting."""

ROUNDS = (3, 9)
"""The fewest and the most measurements of each setting."""

Progress = Callable[[float, float], None]
"""Called with what is done so far and the whole."""


def costs_of(
    simulations: Mapping[Setting, Simulation], state: Simulation, budget: float, progress: Progress
) -> dict[Setting, Cost]:
    """Cost of each setting from a state of the scene on; a budget in s, overrun where the fewest rounds take longer.

    In each round every setting is measured once, every second round in reverse: what makes the processor slower for a
    while does so for all of them. A setting of which a tick takes longer than CHUNK is measured over that tick.
    """
    plans = {setting: _plan(simulation, state) for setting, simulation in simulations.items()}
    a_round = sum(max(CHUNK, spent) for _, _, spent in plans.values())
    rounds = min(ROUNDS[1], max(ROUNDS[0], int(budget / a_round))) if plans else 0
    spent_by: dict[Setting, list[float]] = {setting: [] for setting in plans}
    for count in range(rounds):
        settings = list(plans)
        for index, setting in enumerate(settings if count % 2 == 0 else reversed(settings)):
            ticks, repeats, _ = plans[setting]
            spent = _run(simulations[setting], state, ticks, repeats)
            spent_by[setting].append(spent / (repeats * ticks * simulations[setting].scene.tick))
            progress(count * len(settings) + index + 1, rounds * len(settings))
    return {setting: Cost(median(found), min(found), max(found)) for setting, found in spent_by.items()}


def _plan(simulation: Simulation, state: Simulation) -> tuple[int, int, float]:
    """Ticks from the state on, how often, and about how long (s) all that takes."""
    first = _run(simulation, state, 1, 1)
    ticks = max(1, min(round(SPAN / simulation.scene.tick), int(CHUNK / first)))
    spent = _run(simulation, state, ticks, 1)
    repeats = max(1, round(CHUNK / spent + 0.5))
    return ticks, repeats, repeats * spent


def _run(simulation: Simulation, state: Simulation, ticks: int, repeats: int) -> float:
    """Processor time (s) of some ticks from a state on, several times over; what it takes to go back is not counted."""
    spent = 0.0
    for _ in range(repeats):
        simulation.restore_from(state)
        start = time.process_time()
        simulation.advance(ticks)
        spent += time.process_time() - start
    return spent
