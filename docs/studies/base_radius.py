# SPDX-License-Identifier: Apache-2.0
"""Effect of a ring under bottles, compared with a point, on shipped scenes: scuffing and flow.

    python docs/studies/base_radius.py        (about 10 minutes; writes base_radius.csv beside itself)

Each scene runs with bottles that stand on a point and on rings of some fractions of their radius, over seeds of its
infeeds. `rails J` is the sliding work at the rails, `walls J` that at the walls of the bottles (by rails and by other
bottles), both per entered bottle; `out` is the number that left in the second half of the run. The cost of a ring is
measured by `conveyor-sim explain SCENE --price` on the scene with base_radius.
"""

import csv
from pathlib import Path
from statistics import mean, stdev
from typing import Any

from conveyor_sim.support.interrupt import one_line, while_importing

with while_importing():
    from rich.progress import track

    from conveyor_sim import Simulation, load_scene
    from conveyor_sim.support.resources import scene_path

LANES = [f"lane_{lane}" for lane in range(1, 6)]
CASES: dict[str, tuple[str, float, int, dict[str, Any]]] = {
    "funnel": ("funnel", 40.0, 12, {}),
    "funnel, fed twice as fast": ("funnel", 40.0, 12, {"infeeds": {lane: {"rate": 1.4} for lane in LANES}}),
    "turntable": ("turntable", 40.0, 3, {}),
    "glass_line": ("glass_line", 15.0, 2, {}),
    "accumulation_table": ("accumulation_table", 20.0, 1, {}),  # has nothing that is drawn
}
"""Scene, time to run it for (s), seeds, changes."""
SHARES = (None, 0.73)
"""Base radius over radius: a point, and a can (docs/base.md)."""


def one(case: str, share: float | None, seed: int) -> dict[str, float]:
    """Results of one run."""
    name, duration, _, changes = CASES[case]
    scene = load_scene(scene_path(name))
    types = {
        kind: {} if share is None else {"base_radius": share * given.radius}
        for kind, given in scene.bottle_types.items()
    }
    given = {"duration": duration, "seed": seed, "outputs": {"damage": 1}, "bottle_types": types, **changes}
    sim = Simulation(load_scene(scene_path(name), given), threads=1)
    work: dict[int, float] = {}
    out = 0
    while sim.tick < sim.scene.duration_ticks:
        if sim.tick == sim.scene.duration_ticks // 2:
            out = sim.counts.removed
        sim.advance()
        damage = sim.damage()
        assert damage is not None
        work.update(zip(damage.id.tolist(), damage.scuffing_work.tolist(), strict=True))
    wear = sim.rail_wear()
    assert wear is not None
    return {
        "dt us": sim.model.dt * 1e6,
        "rails J": float(wear.scuffing_work.sum()) / len(work),
        "walls J": mean(work.values()),
        "out": float(sim.counts.removed - out),
    }


def main() -> None:
    """Run all cases and write the table."""
    with (Path(__file__).with_suffix(".csv")).open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        names = ["rails J", "walls J", "out"]
        table.writerow(["scene", "base radius / R", "dt us", *(f for name in names for f in (name, f"sd of {name}"))])
        for case, share in track([(case, share) for case in CASES for share in SHARES], "base_radius"):
            rows = [one(case, share, seed) for seed in range(1, CASES[case][2] + 1)]
            cells: list[Any] = [case, "point" if share is None else share, f"{rows[0]['dt us']:.4g}"]
            for name in names:
                values = [row[name] for row in rows]
                cells += [f"{mean(values):.3g}", f"{stdev(values):.1g}" if len(values) > 1 else ""]
            table.writerow(cells)
            file.flush()


if __name__ == "__main__":
    with one_line():
        main()
