# SPDX-License-Identifier: Apache-2.0
"""Processor time and wall time of config/brewery.yaml, with its controller and a recording.

taskset -c 0 python docs/studies/brewery_speed.py [SECONDS]      # one line
python docs/studies/brewery_speed.py [SECONDS] hall              # ten lines, as many threads as it takes by itself

Prints, for each PIECE of line time: bottles on the conveyors, processor time per tick, bottles times real time by wall
time, the share of bottles asleep so far, the size of the recording so far, and the largest memory so far.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from pathlib import Path

from conveyor_sim.control.load import load
from conveyor_sim.testing import Scenario

SCENES = {"brewery": "brewery", "hall": "brewery/hall"}
"""Names of the scenes, by name of the controller."""
PIECE = {"brewery": 20.0, "hall": 2.0}
"""Line time between two lines of output, s."""


def measure(name: str, seconds: float, bag: Path) -> None:
    """Start the lines of a scene of SCENES, run them for `seconds`, and print a line for each PIECE."""
    piece = PIECE[name]
    with Scenario(SCENES[name], bag=bag, history=piece) as line:
        line.attach(load(f"conveyor_sim.control.brewery:{name}"))
        starts = [name for name, part in line.scene.panel.items() if name.endswith("start") and part.kind == "button"]
        line.run_for(0.5)
        for start in starts:
            line.panel.press(start)
        line.run_for(0.2)
        for start in starts:
            line.panel.release(start)
        while line.time < seconds:
            began, wall = time.process_time(), time.perf_counter()
            line.run_for(piece)
            used, wall = time.process_time() - began, time.perf_counter() - wall
            present, asleep = line.simulation.counts.present, line.simulation.integration.asleep_share
            size = sum(file.stat().st_size for file in bag.rglob("*") if file.is_file())
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            print(
                f"{line.time:5.0f} s: {present} bottles, {1e3 * used * line.scene.tick / piece:.1f} ms a tick, "
                f"{present * piece / wall:.0f} bottles x real time, {asleep:.1%} asleep so far, "
                f"{1e-6 * size:.1f} MB recorded, {1e-3 * memory:.0f} MB of memory",
                flush=True,
            )


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        name = sys.argv[2] if sys.argv[2:] else "brewery"
        measure(name, float(sys.argv[1]) if sys.argv[1:] else 60.0, Path(folder) / "bag")
