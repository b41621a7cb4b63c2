# SPDX-License-Identifier: Apache-2.0
"""Processor time of examples/brewery, with its controller and a recording.

taskset -c 0 python docs/studies/brewery_speed.py [SECONDS]

Prints, for each 20 s of line time: bottles on the conveyors, processor time per tick of one core, bottles times real
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

EXAMPLE = Path(__file__).parents[2] / "examples" / "brewery"
PIECE = 20.0
"""Line time between two lines of output, s."""


def measure(seconds: float, bag: Path) -> None:
    """Start the line, run it for `seconds`, and print a line for each PIECE."""
    with Scenario(EXAMPLE / "brewery.yaml", bag=bag, history=PIECE) as line:
        line.attach(load(f"{EXAMPLE / 'brewery.py'}:brewery"))
        line.run_for(0.5)
        line.panel.press("start")
        line.run_for(0.2)
        line.panel.release("start")
        while line.time < seconds:
            began = time.process_time()
            line.run_for(PIECE)
            used, present = time.process_time() - began, line.simulation.counts.present
            asleep = line.simulation.integration.asleep_share
            size = sum(file.stat().st_size for file in bag.rglob("*") if file.is_file())
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            print(
                f"{line.time:5.0f} s: {present} bottles, {1e3 * used * line.scene.tick / PIECE:.1f} ms a tick, "
                f"{present * PIECE / used:.0f} bottles x real time, {asleep:.1%} asleep so far, "
                f"{1e-6 * size:.1f} MB recorded, {1e-3 * memory:.0f} MB of memory",
                flush=True,
            )


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        measure(float(sys.argv[1]) if sys.argv[1:] else 60.0, Path(folder) / "bag")
