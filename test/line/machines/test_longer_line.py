# SPDX-License-Identifier: Apache-2.0
"""Lines of several failing machines: decomposition against a simulation of the fluid model, and the simulated line."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from types import ModuleType
from typing import Any

import pytest
from study_page import load_study


@pytest.fixture(scope="module")
def longer() -> ModuleType:
    return load_study("validation/longer_line")


def fluid(machines: Sequence[Any], rate: float, buffers: Sequence[float], duration: float, seed: int) -> float:
    """Return throughput / rate of the continuous-flow model of n machines, simulated by events."""
    draw, number = random.Random(seed), len(machines)
    up, level, time, made = [True] * number, [room / 2 for room in buffers], 0.0, 0.0
    while time < duration:
        works = list(up)
        for i in range(1, number):
            works[i] = works[i] and (level[i - 1] > 0.0 or works[i - 1])
        for i in reversed(range(number - 1)):
            works[i] = works[i] and (level[i] < buffers[i] or works[i + 1])
        for i in range(1, number):
            works[i] = works[i] and (level[i - 1] > 0.0 or works[i - 1])
        rates = [
            1.0 / machine.to_repair if not up[i] else works[i] / machine.between_failures
            for i, machine in enumerate(machines)
        ]
        passed, full = draw.expovariate(sum(rates)), None
        for i, room in enumerate(buffers):
            flow = (works[i] - works[i + 1]) * rate
            to_end = (room - level[i]) / flow if flow > 0.0 else level[i] / -flow if flow < 0.0 else math.inf
            if to_end < passed:
                passed, full = to_end, i
        for i in range(number - 1):
            level[i] += (works[i] - works[i + 1]) * rate * passed
        made, time = made + works[-1] * rate * passed, time + passed
        if full is not None:
            level[full] = 0.0 if works[full] < works[full + 1] else buffers[full]
        else:
            failed = draw.choices(range(number), rates)[0]
            up[failed] = not up[failed]
    return made / (rate * time)


def test_decomposition_of_two_machines_is_the_closed_form(longer: ModuleType) -> None:
    first, second = longer.Machine(4.0, 1.0), longer.Machine(9.0, 3.0)
    expected = longer.theory.efficiency(first, second, 4.0, 12.0)
    assert longer.decomposition((first, second), 4.0, [12.0]) == pytest.approx(expected, rel=1e-12)


def test_decomposition_has_the_known_limits(longer: ModuleType) -> None:
    """Without buffers 1 / (1 + sum of repair / failure times) (Buzacott); with large ones, the worst machine's own."""
    machines = longer.Machine(4.0, 1.0), longer.Machine(9.0, 1.5), longer.Machine(20.0, 2.0)
    sum_of_ratios = sum(machine.to_repair / machine.between_failures for machine in machines)
    assert longer.decomposition(machines, 4.0, [1e-9, 1e-9]) == pytest.approx(1.0 / (1.0 + sum_of_ratios), rel=1e-6)
    assert longer.decomposition(machines, 4.0, [1e4, 1e4]) == pytest.approx(machines[0].alone, rel=1e-3)


@pytest.mark.parametrize("name", ["equal machines", "unequal"])
def test_decomposition_agrees_with_the_fluid_model(longer: ModuleType, name: str) -> None:
    """Within 1.5 %, the accuracy of the method; a line without buffers would be off by 20 %."""
    _, machines = longer.LINES[name]
    rooms = [9.0, 6.0, 12.0]
    runs = [fluid(machines, 4.0, rooms, 20_000.0, seed) for seed in range(3)]
    assert sum(runs) / 3.0 == pytest.approx(longer.decomposition(machines, 4.0, rooms), rel=0.015)


def test_a_simulated_line_passes_as_many_bottles_as_decomposition_expects(longer: ModuleType) -> None:
    """One run of 1000 s has a standard deviation of 1.5 %; four of these are allowed."""
    simulated = longer.simulate({"line": "unequal", "seed": 0})["efficiency"]
    assert simulated == pytest.approx(longer.expected(*longer.LINES["unequal"]), abs=0.06)
