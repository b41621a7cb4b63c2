"""Two machines that fail and a buffer between them: the theory, and the simulated line against it."""

from __future__ import annotations

import math
import random
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from scipy.stats import t as student
from study_page import load_study


@pytest.fixture(scope="module")
def theory() -> ModuleType:
    return load_study("two_machines")


def half_width(values: list[float]) -> float:
    """Of the confidence interval of a mean, 99 %."""
    return float(student.ppf(0.995, len(values) - 1) * np.std(values, ddof=1) / math.sqrt(len(values)))


def fluid(first: Any, second: Any, rate: float, buffer: float, duration: float, seed: int) -> float:
    """Throughput over rate of the model of continuous flow, simulated from event to event; half full at first."""
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


def delayed(first: Any, second: Any, rate: float, holds: int, transport: float, bottles: int, seed: int) -> float:
    """The same with bottles that take a time from machine to machine: when each one leaves the first, and the
    second."""
    draw = random.Random(seed)
    until_1, until_2 = draw.expovariate(1.0 / first.between_failures), draw.expovariate(1.0 / second.between_failures)
    left, taken = 0.0, [-math.inf] * holds
    ready_1 = ready_2 = 0.0
    for bottle in range(bottles):
        left = max(ready_1, taken[bottle % holds])
        took = taken[bottle % holds] = max(ready_2, left + transport)
        ready_1, until_1 = left + 1.0 / rate, until_1 - 1.0 / rate
        while until_1 <= 0.0:
            ready_1 += draw.expovariate(1.0 / first.to_repair)
            until_1 += draw.expovariate(1.0 / first.between_failures)
        ready_2, until_2 = took + 1.0 / rate, until_2 - 1.0 / rate
        while until_2 <= 0.0:
            ready_2 += draw.expovariate(1.0 / second.to_repair)
            until_2 += draw.expovariate(1.0 / second.between_failures)
    return bottles / (rate * left)


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
    """Many small bottles, 60 on the conveyor: the closed form with the room that is left, not with all of it."""
    first, second = theory.Machine(4.0, 1.0), theory.Machine(4.0, 1.0)
    runs = [delayed(first, second, 20.0, 60, transport, 60_000, seed) for seed in range(10)]
    expected = theory.conveyor_efficiency(first, second, 20.0, 60, transport)
    assert half_width(runs) < 0.008
    assert np.mean(runs) == pytest.approx(expected, abs=half_width(runs))
    if transport > 1.0:
        assert abs(np.mean(runs) - theory.efficiency(first, second, 20.0, 60)) > half_width(runs)
