# SPDX-License-Identifier: Apache-2.0
"""Cost of config/filler_block.yaml with its controller, as it fills with bottles, in CPU time of one core.

It runs with its own setting, `draft`, and with `fast`.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from bench.markdown import table as markdown
from bench.measure import Effort, say
from bench.rows import Row, Rows
from conveyor_sim.control.filler_block import filler_block
from conveyor_sim.run.scan_loop import ScanLoop
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.resources import scene_path

CASE, CONTESTANT, FAST = "filler block", "one thread", "fast"
SETTINGS: Mapping[str, dict[str, Any] | None] = {CONTESTANT: None, FAST: {"accuracy": "fast"}}
"""Overrides of the scene, by contestant."""
FACTOR, TICK, BOTTLES, FILLED = "times real time", "us a tick", "bottles at the end", "bottles filled"
PERIOD, QUICK_PERIOD = 10.0, 1.0
"""Simulated time of one measurement, s."""
PERIODS = 6
"""In the last two, bottles are on all conveyors and in all wheels."""
ROUNDS = 3


def measure(effort: Effort) -> list[Row]:
    """Run the scene from its start in each round, with the start button pressed, and measure period by period."""
    period = QUICK_PERIOD if effort.quick else PERIOD
    rows = []
    for turn in range(min(ROUNDS, effort.rounds)):
        say(f"filler block, round {turn + 1}")
        for contestant in SETTINGS:
            rows += _run(contestant, period, turn)
    return rows


def _run(contestant: str, period: float, turn: int) -> list[Row]:
    simulation = Simulation(load_scene(scene_path("filler_block"), SETTINGS[contestant]), threads=1)
    scans = ScanLoop(simulation, filler_block())
    scans.before_tick(None)
    simulation.advance(1)  # compiles
    simulation.command(["panel/start/press"], [1.0], writer_kind="operator")
    ticks = round(period / simulation.scene.tick)
    rows, filled = [], 0.0
    for number in range(1, PERIODS + 1):
        begin = time.process_time()
        for _ in range(ticks):
            scans.before_tick(None)
            simulation.advance(1)
        took = time.process_time() - begin
        before, filled = filled, _filled(simulation)
        values = {
            FACTOR: period / took,
            TICK: 1e6 * took / ticks,
            BOTTLES: float(len(simulation.bottles().x)),
            FILLED: filled - before,
        }
        rows += [Row(CASE, number * period, contestant, quantity, turn, value) for quantity, value in values.items()]
    return rows


def _filled(simulation: Simulation) -> float:
    return float(simulation.signals()[simulation.process_image.signal_names.index("carousels/valves/good")])


def tables(rows: Rows) -> str:
    """Return one table: a row per period, the costs with `fast` last."""
    columns = [(CONTESTANT, quantity) for quantity in (BOTTLES, FILLED, TICK, FACTOR)]
    columns += [(FAST, quantity) for quantity in (FILLED, TICK, FACTOR)]
    heads = [quantity if contestant == CONTESTANT else f"{quantity}, fast" for contestant, quantity in columns]
    body = []
    for before, end in zip([0.0, *rows.ns(CASE)], rows.ns(CASE), strict=False):
        spreads = [rows.spread(CASE, end, *column) or "not measured" for column in columns]
        body.append([f"{before:g} s to {end:g} s", *spreads])
    return markdown(["simulated time", *heads], body)


def slowest(rows: Rows) -> float | None:
    """Return the least speed of all periods, times real time."""
    spreads = [rows.spread(CASE, end, CONTESTANT, FACTOR) for end in rows.ns(CASE)]
    return min((spread.middle for spread in spreads if spread is not None), default=None)
