# SPDX-License-Identifier: Apache-2.0
"""Figures of generated lines: no ratio passes 100 %, and counters, signals and protocol servers agree."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from line.machines.machine_line import END, line, sink, source, station

from conveyor_sim.columns.counters import LINE, CounterColumns
from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.line.machines.counters import RESET_COUNTERS
from conveyor_sim.line.machines.efficiency import CATEGORIES
from conveyor_sim.line.machines.weihenstephan import data_points
from conveyor_sim.simulation import Simulation

RATIOS = ("availability", "effectiveness", "set_effectiveness", "quality", "oee")
ROUNDING = 1e-9
"""Tolerance of sums of many parts of a cycle."""


def outline(left: float, below: float, right: float, above: float) -> list[list[float]]:
    """Return the corners of a rectangle, m."""
    return [[left, below], [right, below], [right, above], [left, above]]


def generated(seed: int) -> tuple[Simulation, np.random.Generator]:
    """Return a line of random machines: one or two packers, perhaps a station, failures, ramps, overspeed."""
    draw = np.random.default_rng(seed)

    def machine(low: float, high: float) -> dict[str, Any]:
        rate = float(draw.uniform(low, high))
        chosen: dict[str, Any] = {"rate": rate, "suspend_after": float(draw.choice([0.05, 0.5, 100.0]))}
        if draw.random() < 0.6:
            chosen["rate_limit"] = rate * float(draw.uniform(1.0, 2.0))
        if draw.random() < 0.4:
            chosen["ramp_up"] = float(draw.uniform(0.1, 1.0))
        if draw.random() < 0.5:
            way = {"between": {"kind": "exponential", "mean": 2.0}, "repair": {"kind": "exponential", "mean": 0.5}}
            chosen["failures"] = {"jam": way}
        if draw.random() < 0.4:
            chosen["planned_stops"] = {"break": {"start": 3.0, "duration": 0.7, "every": 4.0}}
        if draw.random() < 0.4:
            chosen["acting_times"] = {"starting": 0.11, "unholding": 0.07, "suspending": 0.05, "unsuspending": 0.08}
        return chosen

    machines = {"filler": source(**machine(1.0, 4.0), bad_share=0.2), "packer": sink(**machine(1.0, 5.0))}
    if draw.random() < 0.5:
        machines["second"] = sink(**machine(0.5, 3.0), region=outline(1.2, -0.2, 1.4, 0.2))
    if draw.random() < 0.6:
        machines["capper"] = station(outline(0.5, -0.2, 0.7, 0.2), [0.9, 0.0], **machine(1.0, 5.0))
    if draw.random() < 0.3:
        machines["packer"]["region"] = END
        machines["thrower"] = {"kind": "reject", "region": outline(1.5, -0.2, 1.6, 0.2)}
    return line(machines=machines, duration=100.0, seed=seed), draw


def disturb(sim: Simulation, draw: np.random.Generator) -> None:
    """Reset counters, change rates and stop machines at random."""
    names = [name for name in sim.process_image.command_names if name.startswith("machines/")]
    limits = {tag.name: tag.high for tag in sim.process_image.commands}
    for name in names:
        end = name.rpartition("/")[2]
        if end == "rate" and draw.random() < 0.3:
            share = float(draw.choice([0.0, 0.3, 1.0]))
            sim.command([name], [share * limits[name]])
        elif end in ("run", "fire") and draw.random() < 0.2:
            sim.command([name], [float(draw.random() < 0.6)])
    if draw.random() < 0.5:
        columns = counters(sim)
        names = [name for name in columns.name if draw.random() < 0.5]
        sim.give(Input("commands", "shift", "operator", RESET_COUNTERS, tuple(names), ()))


def counters(sim: Simulation) -> CounterColumns:
    columns = sim.line.counters()
    assert columns is not None
    return columns


@pytest.mark.parametrize("seed", range(24))
def test_no_ratio_passes_100_percent(seed: int) -> None:
    """At each of many moments, with resets within cycles, overspeed, and machines in parallel."""
    sim, draw = generated(seed)
    seen = 0
    for _ in range(60):
        disturb(sim, draw)
        sim.advance(int(draw.integers(1, 40)))
        columns = counters(sim)
        for ratio in RATIOS:
            values = getattr(columns, ratio)
            known = values[np.isfinite(values)]
            seen += len(known)
            assert (known >= 0.0).all() and (known <= 1.0 + ROUNDING).all(), (ratio, sim.tick, columns.name, values)
            assert not np.isinf(values).any(), (ratio, sim.tick)
    assert seen > 100


@pytest.mark.parametrize("seed", range(24, 32))
def test_counters_signals_and_data_points_agree(seed: int) -> None:
    """Bottles and times of each machine, from the start on, without a reset."""
    sim, draw = generated(seed)
    for _ in range(20):
        sim.advance(int(draw.integers(20, 90)))
        image, columns = sim.process_image, counters(sim)
        values = dict(zip(image.signal_names, sim.signals().tolist(), strict=True))
        commands = dict(zip(image.command_names, sim.line.read_back.values, strict=True))
        for index, name in enumerate(columns.name):
            if not columns.category[index]:
                continue
            processed = values.get(f"{name}/processed", values.get(f"{name}/produced"))
            assert columns.processed[index] == processed
            assert columns.defective[index] == values.get(f"{name}/defective", columns.defective[index])
            assert columns.starved[index] == values.get(f"{name}/starved_time", 0.0)
            assert columns.blocked[index] == values.get(f"{name}/blocked_time", 0.0)
            assert columns.category[index] == CATEGORIES[int(values[f"{name}/category"])]
            points = data_points(name, {tag.name: tag for tag in image.tags}, values | commands)
            assert points["WS_Tot_Containers"] == processed
        counts = sim.counts
        assert counts.fed == counts.removed + counts.present + counts.held
        line_row = columns.name.index(LINE)
        sinks = [i for i, name in enumerate(columns.name) if f"{name}/taken" in values]
        assert columns.processed[line_row] == sum(int(columns.processed[i]) for i in sinks)
        assert 0 <= sum(values[f"{columns.name[i]}/taken"] for i in sinks) - columns.processed[line_row] <= len(sinks)


def test_resets_lose_no_bottle() -> None:
    """Bottles of all intervals between resets, also within cycles, add up to those of the complete time."""
    sim, draw = generated(5)
    total = 0
    for _ in range(40):
        sim.advance(int(draw.integers(1, 60)))
        total += int(counters(sim).processed[0])
        sim.give(Input("commands", "shift", "operator", RESET_COUNTERS, ("machines/filler",), ()))
        # The reset takes effect before the next tick, with no bottle in between.
    sim.advance()
    total += int(counters(sim).processed[0])
    values = dict(zip(sim.process_image.signal_names, sim.signals().tolist(), strict=True))
    assert total == values["machines/filler/produced"] > 10


def test_a_cycle_counts_with_its_part_since_the_reset() -> None:
    """A bottle of 50 ticks completes 10 ticks after a reset: one bottle, but a fifth of a cycle."""
    sim = line(machines={"filler": source(2.0)})
    sim.advance(40)
    sim.give(Input("commands", "shift", "operator", RESET_COUNTERS, (), ()))
    sim.advance(9)
    assert (counters(sim).processed[0], counters(sim).effectiveness[0]) == (0, 0.0)
    sim.advance(1)
    assert (counters(sim).processed[0], counters(sim).effectiveness[0]) == (1, pytest.approx(1.0))
    assert math.isnan(counters(sim).oee[1])  # no bottle has left the line
