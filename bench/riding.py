# SPDX-License-Identifier: Apache-2.0
"""Savings by riding: ticks of a line with and without it, in CPU time of one core, and the number of riding bottles."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from bench.markdown import table as markdown
from bench.measure import Effort, say
from bench.rows import Row, Rows, Spread, spread_of
from conveyor_sim.engine.lists.riding import skipped_slots
from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.resources import scene_path

CASE = "riding"
WITH, WITHOUT, SHARE = "us a tick with", "us a tick without", "share that rides"
SCENES = (
    "scenarios/zoned_line",
    "scenarios/reject_line",
    "scenarios/watched_eyes",
    "scenarios/buffer_lane",
    "scenarios/pressureless_combiner",
    "scenarios/pressure_combiner",
    "scenarios/funnel_mouth",
    "paper_plant",
    "funnel",
    "glass_line",
    "accumulation_table",
)
LONG = "zoned_line, 290 bottles on 90 m"
LONG_LINE: Mapping[str, Any] = {
    "conveyors": {"zone6": {"path": [{"straight": 90.0}]}},
    "bottles": [{"grid": {"type": "bottle", "along": "zone6", "at": 0.5, "rows": 1, "columns": 290, "pitch": 0.3}}],
}
SECONDS, QUICK_SECONDS = 20.0, 1.0
"""Simulated, from the start of the scene."""


def measure(effort: Effort) -> list[Row]:
    """Every scene in turn, with and without."""
    rows = []
    seconds = QUICK_SECONDS if effort.quick else SECONDS
    names = (*SCENES[:1], LONG) if effort.quick else (*SCENES, LONG)
    for turn in range(effort.rounds):
        for name in names:
            say(f"riding, round {turn + 1}: {name}")
            for quantity in (WITH, WITHOUT) if turn % 2 else (WITHOUT, WITH):
                rows.append(Row(CASE, 0.0, name, quantity, turn, _tick(_scene(name, quantity == WITH), seconds)))
            if turn == 0:
                rows.append(Row(CASE, 0.0, name, SHARE, turn, _share(_scene(name, True), seconds)))
    return rows


def _scene(name: str, on: bool) -> Scene:
    more: dict[str, Any] = dict(LONG_LINE) if name == LONG else {}
    path = scene_path("scenarios/zoned_line" if name == LONG else name)
    return load_scene(path, {**more, "effects": {"riding": "on" if on else "off"}})


def _tick(scene: Scene, seconds: float) -> float:
    """CPU time of a tick, us."""
    simulation = Simulation(scene, threads=1)
    simulation.advance(1)
    ticks = round(seconds / scene.tick)
    begin = time.process_time()
    simulation.advance(ticks)
    return 1e6 * (time.process_time() - begin) / ticks


def _share(scene: Scene, seconds: float) -> float:
    """Bottles that ride over those that are there, summed over the ends of ticks."""
    simulation = Simulation(scene, threads=1)
    riders = present = 0
    for _ in range(round(seconds / scene.tick)):
        simulation.advance(1)
        riders += _riders(simulation)
        present += simulation.counts.present
    return riders / max(1, present)


def _riders(simulation: Simulation) -> int:
    """Bottles that the next step would leave out; on one thread."""
    world = simulation._state.world
    slots = world.bottles.id
    return int((skipped_slots(world.riding, slots.size) & (slots >= 0)).sum())


def tables(rows: Rows) -> str:
    """Return a table with one line per scene."""
    body = []
    for name in rows.contestants(CASE):
        share = rows.spread(CASE, 0.0, name, SHARE)
        pace = [rows.spread(CASE, 0.0, name, quantity) for quantity in (WITHOUT, WITH)]
        times = _times(rows, name)
        body.append([name, None if share is None else f"{100 * share.middle:.0f} %", *pace, times])
    return markdown(["", "bottles that ride", "us a tick without", "with", "times as fast"], body)


def _times(rows: Rows, name: str) -> Spread | None:
    without, riding = (rows.values(CASE, 0.0, name, quantity) for quantity in (WITHOUT, WITH))
    return spread_of(without[turn] / riding[turn] for turn in sorted(without.keys() & riding.keys()))
