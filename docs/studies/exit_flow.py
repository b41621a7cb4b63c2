# SPDX-License-Identifier: Apache-2.0
"""Regularity of the exit flow of the paper's plant, over guide angles, table speeds, time steps and integrators.

    python docs/studies/exit_flow.py        (about 3 minutes; writes exit_flow.csv beside itself)

The study counts the bottles that come onto bend_1, the first belt of the single file, in every 5 s of 50 s.
"""

import csv
from pathlib import Path
from typing import Any

from conveyor_sim.support.interrupt import one_line, while_importing

with while_importing():
    import numpy as np
    from rich.progress import track

    from conveyor_sim import Simulation, load_scene
    from conveyor_sim.support.resources import scene_path

DURATION = 50.0  # s
WINDOW = 5.0  # s
LEFT = {
    "23 deg": [[0, 0.6], [0.6, 0.6], [2.4, -0.155]],
    "28 deg": [[0, 0.6], [1.0, 0.6], [2.4, -0.155]],
    "37 deg": [[0, 0.6], [1.4, 0.6], [2.4, -0.155]],
}


def entries(changes: dict[str, Any]) -> list[int]:
    """Bottles onto bend_1 in each window."""
    simulation = Simulation(load_scene(scene_path("paper_plant"), {"duration": DURATION, **changes}))
    entered = simulation.model.belts.index("bend_1")
    was: dict[int, int] = {}
    times = []
    while simulation.tick < simulation.scene.duration_ticks:
        simulation.advance()
        bottles = simulation.bottles()
        for bottle, belt in zip(bottles.id.tolist(), bottles.belt.tolist(), strict=True):
            if belt == entered and was.get(bottle) != entered:
                times.append(simulation.time)
            was[bottle] = belt
    return np.histogram(times, bins=np.arange(0.0, DURATION + WINDOW / 2, WINDOW))[0].tolist()


def cases() -> list[tuple[str, float, int, str]]:
    """Left guide, table speed (m/s), steps a tick, integrator."""
    shipped = ("23 deg", 0.2)
    found = [(guide, speed, 250, "semi_implicit_euler") for guide in LEFT for speed in (0.15, 0.2, 0.25)]
    for steps in (250, 500, 1000):
        found += [(*shipped, steps, method) for method in ("semi_implicit_euler", "velocity_verlet")]
    return list(dict.fromkeys(found))


def main() -> None:
    with (Path(__file__).with_suffix(".csv")).open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        windows = [f"{start:g}-{start + WINDOW:g} s" for start in np.arange(0.0, DURATION, WINDOW)]
        table.writerow(["left guide", "table m/s", "steps a tick", "integrator", *windows])
        for guide, speed, steps, method in track(cases(), "exit_flow"):
            changes = {
                "guides": {"funnel": {"left": LEFT[guide]}},
                "conveyors": {"table": {"speed": speed}},
                "accuracy": {"per_tick": steps, "integrator": method},
            }
            table.writerow([guide, speed, steps, method, *entries(changes)])


if __name__ == "__main__":
    with one_line():
        main()
