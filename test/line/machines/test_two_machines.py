# SPDX-License-Identifier: Apache-2.0
"""Two failing machines with a buffer between them: theory against the simulated line."""

from __future__ import annotations

import math
import random
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import islice
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from scipy.stats import t as student
from study_page import load_study

from conveyor_sim.line.devices.setup import random_stream
from conveyor_sim.line.machines.failures import Draws
from conveyor_sim.scene import Scene

Draw = Callable[[], float]


@pytest.fixture(scope="module")
def theory() -> ModuleType:
    return load_study("validation/two_machines")


def half_width(values: list[float]) -> float:
    """Return half the width of the 99 % confidence interval of a mean."""
    return float(student.ppf(0.995, len(values) - 1) * np.std(values, ddof=1) / math.sqrt(len(values)))


def fluid(first: Any, second: Any, rate: float, buffer: float, duration: float, seed: int) -> float:
    """Return throughput / rate of the continuous-flow model, simulated by events; the buffer is half full at first."""
    draw = random.Random(seed)
    time, level, made, up_1, up_2 = 0.0, buffer / 2, 0.0, True, True
    while time < duration:
        works_1 = up_1 and (up_2 or level < buffer)
        works_2 = up_2 and (up_1 or level > 0.0)
        event_1 = works_1 / first.between_failures if up_1 else 1.0 / first.to_repair
        event_2 = works_2 / second.between_failures if up_2 else 1.0 / second.to_repair
        flow = (works_1 - works_2) * rate
        to_end = (buffer - level) / flow if flow > 0.0 else level / -flow if flow < 0.0 else math.inf
        passed = min(draw.expovariate(event_1 + event_2), to_end)
        time += passed
        made += works_2 * rate * passed
        if passed == to_end:
            level = buffer if flow > 0.0 else 0.0
        else:
            level += flow * passed
            if draw.random() * (event_1 + event_2) < event_1:
                up_1 = not up_1
            else:
                up_2 = not up_2
    return made / (rate * time)


def discrete(draws: Sequence[tuple[Draw, Draw]], cycle: float, holds: int, transport: float) -> Iterator[float]:
    """Return the times at which the second machine takes each bottle, by a model with transport time.

    draws: sources of the times between failures and to repair, of each machine. Any unit of time may be used.
    """
    until = [between() for between, _ in draws]
    ready, taken = [0.0, 0.0], deque([-math.inf] * holds)
    while True:
        left = max(ready[0], taken.popleft())
        took = max(ready[1], left + transport)
        taken.append(took)
        yield took
        for machine, (began, (between, repair)) in enumerate(zip((left, took), draws, strict=True)):
            ready[machine], until[machine] = began + cycle, until[machine] - cycle
            while until[machine] <= 0.0:
                ready[machine] += repair()
                until[machine] += between()


def delayed(machines: Sequence[Any], rate: float, holds: int, transport: float, bottles: int, seed: int) -> float:
    """Return throughput / rate of the discrete model, with exponential times."""
    draw = random.Random(seed)
    draws = [tuple(partial(draw.expovariate, 1.0 / mean) for mean in machine) for machine in machines]
    return bottles / (rate * next(islice(discrete(draws, 1.0 / rate, holds, transport), bottles, None)))


@pytest.mark.parametrize("second", [(4.0, 1.0), (5.0, 2.0)], ids=["equal", "other"])
@pytest.mark.parametrize("buffer", [0.0, 3.0, 9.0, 30.0])
def test_the_closed_form_is_that_of_continuous_flow(
    theory: ModuleType, second: tuple[float, float], buffer: float
) -> None:
    """Within the 99 % confidence interval of 30 simulated runs."""
    machines = theory.Machine(4.0, 1.0), theory.Machine(*second)
    runs = [fluid(*machines, 4.0, buffer, 3000.0, seed) for seed in range(30)]
    assert half_width(runs) < 0.01
    assert np.mean(runs) == pytest.approx(theory.efficiency(*machines, 4.0, buffer), abs=half_width(runs))


def test_the_closed_form_has_the_known_limits(theory: ModuleType) -> None:
    """Without a buffer 1 / (1 + sum of repair / failure times) (Buzacott); with an infinite one, the worse machine's
    own."""
    first, second = theory.Machine(4.0, 1.0), theory.Machine(5.0, 2.0)
    assert theory.efficiency(first, second, 4.0, 0.0) == pytest.approx(1.0 / (1.0 + 0.25 + 0.4))
    assert theory.efficiency(first, second, 4.0, 1000.0) == pytest.approx(second.alone)
    assert theory.efficiency(second, first, 4.0, 20.0) == pytest.approx(theory.efficiency(first, second, 4.0, 20.0))
    almost = theory.efficiency(first, theory.Machine(4.0, 1.0 + 1e-9), 4.0, 9.0)
    assert theory.efficiency(first, first, 4.0, 9.0) == pytest.approx(almost)


@pytest.mark.parametrize("transport", [0.0, 0.75, 1.5])
def test_bottles_on_their_way_buffer_nothing(theory: ModuleType, transport: float) -> None:
    """There are many small bottles, 60 on the conveyor.

    The closed form applies with the room that is left, not with all of it.
    """
    first, second = theory.Machine(4.0, 1.0), theory.Machine(4.0, 1.0)
    runs = [delayed((first, second), 20.0, 60, transport, 60_000, seed) for seed in range(10)]
    expected = theory.conveyor_efficiency(first, second, 20.0, 60, transport)
    assert half_width(runs) < 0.008
    assert np.mean(runs) == pytest.approx(expected, abs=half_width(runs))
    if transport > 1.0:
        assert abs(np.mean(runs) - theory.efficiency(first, second, 20.0, 60)) > half_width(runs)


class Runs:
    """Runs of the simulated line, 300 s each after the warm-up."""

    LENGTH, DURATION, SEEDS = 1.0, 300.0, range(8)

    def __init__(self, theory: ModuleType) -> None:
        self.theory, self.machine = theory, theory.Machine(4.0, 1.0)
        self.scenes = [theory.line(self.LENGTH, self.machine, self.machine, seed) for seed in self.SEEDS]
        self.holds, self.transport = theory.holds(self.LENGTH), theory.transport(self.LENGTH)
        self.taken = [theory.taken(scene, self.DURATION) for scene in self.scenes]

    @property
    def efficiencies(self) -> list[float]:
        """Efficiency of each run."""
        return [taken / (self.theory.RATE * self.DURATION) for taken in self.taken]

    def expected(self, holds: int, transport: float) -> list[int]:
        """Return the bottles that the discrete model takes in each run with the same failures."""
        tick = self.scenes[0].tick
        begin, end = self.theory.WARM_UP / tick, (self.theory.WARM_UP + self.DURATION) / tick
        counts = []
        for scene in self.scenes:
            draws = [failures_of(scene, name) for name in ("first", "second")]
            count = 0
            for took in discrete(draws, 1.0 / (self.theory.RATE * tick), holds, transport / tick):
                if took > end:
                    break
                count += took > begin
            counts.append(count)
        return counts


def failures_of(scene: Scene, name: str) -> tuple[Draw, Draw]:
    """Return the draws of a machine in ticks: times between failures, and to repair."""
    machine: Any = scene.machines[name]
    way = machine.failures["breakdown"]
    between, repair = (
        Draws(times, random_stream(scene.seed, f"machines/{name}", f"failures/breakdown/{what}"), scene.tick).ticks
        for what, times in (("between", way.between), ("repair", way.repair))
    )
    return between, repair


@pytest.fixture(scope="module")
def runs(theory: ModuleType) -> Runs:
    return Runs(theory)


def test_the_simulated_line_has_the_efficiency_of_the_closed_form(runs: Runs) -> None:
    """Model: continuous flow, with the transport delay. Within the 99 % confidence interval of the runs, which is
    narrow enough to exclude a line without a buffer, and one with an infinite one.
    """
    theory, machine, simulated = runs.theory, runs.machine, np.mean(runs.efficiencies)
    expected = theory.conveyor_efficiency(machine, machine, theory.RATE, runs.holds, runs.transport)
    assert half_width(runs.efficiencies) < 0.05
    assert simulated == pytest.approx(expected, abs=half_width(runs.efficiencies))
    assert simulated - half_width(runs.efficiencies) > theory.efficiency(machine, machine, theory.RATE, 0.0)
    assert simulated + half_width(runs.efficiencies) < machine.alone


def test_with_the_same_failures_the_same_bottles_pass(runs: Runs) -> None:
    """The model of discrete bottles has the failures that the line draws.

    Each run is within 2.5 %, the sum within 0.7 %. Without transport delay, without a buffer or with an infinite one,
    the error would be at least 1.5 %. (A moving queue has room for somewhat less than a standing one, from which
    `holds` is derived.)
    """
    simulated = np.array(runs.taken)
    departures = {
        name: np.array(runs.expected(holds, transport)) / simulated - 1.0
        for name, (holds, transport) in {
            "line": (runs.holds, runs.transport),
            "no delay": (runs.holds, 0.0),
            "no buffer": (1, 0.0),
            "infinite": (10_000, runs.transport),
        }.items()
    }
    right = departures.pop("line")
    assert np.abs(right).max() < 0.025
    assert abs(right.mean()) < 0.007
    assert all(abs(wrong.mean()) > 0.015 for wrong in departures.values()), departures
