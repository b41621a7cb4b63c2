"""What the guard costs: its share of the time that ticks take, on some scenes. Writes docs/stability/guard.csv.

The parts are timed within one run, so the share hardly depends on what else the machine does.
"""

import csv
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from conveyor_sim.guard import guard
from conveyor_sim.guard.memory import Memory
from conveyor_sim.integration import Integration
from conveyor_sim.resources import scene_path
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

TABLE = Path(__file__).parent.parent / "stability" / "guard.csv"
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
        for owner, name in methods:
            setattr(owner, name, self._timed(getattr(owner, name)))

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


def main() -> None:
    """Measure and write."""
    guarding = Stopwatch((guard.Guard, "begin"), (guard.Guard, "end"), (Integration, "_tell"), (Memory, "keep"))
    whole = Stopwatch((Simulation, "advance"))
    rows = []
    for name, (before, ticks) in SCENES.items():
        simulation = Simulation(load_scene(scene_path(name), {"duration": 1000.0}), threads=1)
        simulation.advance(max(1, before))
        guarding.seconds = whole.seconds = 0.0
        simulation.advance(ticks)
        share = guarding.seconds / whole.seconds
        bottles, steps = simulation.counts.present, simulation.model.steps_per_tick
        tick = whole.seconds / ticks
        rows.append(
            (name, bottles, steps, f"{1e3 * tick:.3g}", f"{1e6 * guarding.seconds / ticks:.3g}", f"{share:.4f}")
        )
        print(f"{name}: {bottles} bottles, {steps} steps a tick, {100.0 * share:.2f} % of {1e3 * tick:.3g} ms")
    TABLE.parent.mkdir(exist_ok=True)
    with TABLE.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("scene", "bottles", "steps a tick", "tick (ms)", "guard (us a tick)", "share"))
        writer.writerows(rows)


if __name__ == "__main__":
    main()
