# SPDX-License-Identifier: Apache-2.0
"""Cost of the guard: its share of the time of ticks, on some scenes.

The parts are timed within one run, so the share hardly depends on the load of the machine.
"""

import csv
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from conveyor_sim.physics.stepping.guard.guard import Guard
from conveyor_sim.physics.stepping.tick import Integration
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.resources import scene_path

COLUMNS = ("scene", "bottles", "steps a tick", "tick (ms)", "guard (us)", "share (%)")
SCENES = {
    "two_bottles": (0, 400),
    "paper_plant": (3000, 1000),
    "accumulation_table": (500, 300),
    "glass_line": (300, 300),
}
"""Ticks before, and ticks that are timed."""


class Stopwatch:
    """Adds up the time that some methods take; what they call of each other is counted once."""

    def __init__(self, *methods: tuple[type, str]) -> None:
        self.seconds = 0.0
        self._inside = False
        self._methods = [(owner, name, getattr(owner, name)) for owner, name in methods]
        for owner, name, method in self._methods:
            setattr(owner, name, self._timed(method))

    def stop(self) -> None:
        """Leave the methods as they were."""
        for owner, name, method in self._methods:
            setattr(owner, name, method)

    def _timed(self, method: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*arguments: Any) -> Any:
            if self._inside:
                return method(*arguments)
            self._inside, began = True, time.perf_counter()
            try:
                return method(*arguments)
            finally:
                self._inside = False
                self.seconds += time.perf_counter() - began

        return timed


def measure(path: Path) -> None:
    """Time the scenes; into a CSV file."""
    guarding = Stopwatch((Guard, "begin"), (Guard, "end"), (Integration, "_tell"))
    whole = Stopwatch((Simulation, "advance"))
    rows = []
    for name, (before, ticks) in SCENES.items():
        simulation = Simulation(load_scene(scene_path(name), {"duration": 1000.0}), threads=1)
        simulation.advance(max(1, before))
        guarding.seconds = whole.seconds = 0.0
        simulation.advance(ticks)
        tick, guard = whole.seconds / ticks, guarding.seconds / ticks
        bottles, steps = simulation.counts.present, simulation.model.steps_per_tick
        share = f"{100.0 * guard / tick:.2g}"
        rows.append((name, bottles, steps, f"{1e3 * tick:.3g}", f"{1e6 * guard:.3g}", share))
    guarding.stop()
    whole.stop()
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(rows)
