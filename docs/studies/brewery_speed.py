# SPDX-License-Identifier: Apache-2.0
"""Speed of config/brewery.yaml and of brewery/hall in production, as `conveyor-sim run` runs them, with a recording.

taskset -c 0 python docs/studies/brewery_speed.py brewery [SECONDS]     # controller in Python
taskset -c 0 python docs/studies/brewery_speed.py failures [SECONDS]    # drawn failures, program in Structured Text
python docs/studies/brewery_speed.py hall [SECONDS]                     # ten lines, threads chosen by itself

Prints, for each piece of line time: bottles on the conveyors, processor time per tick, and bottles times real time by
wall time; at the end, the size of the recording and the largest memory.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.control.load import load
from conveyor_sim.control.scan import Controller
from conveyor_sim.control.st import StructuredText
from conveyor_sim.run.runner import run_scene
from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.support.resources import config_dir

BREWERY = config_dir() / "brewery.yaml"
HALL = config_dir() / "brewery" / "hall.yaml"
DWELL = 30.0
"""Holding time in the pasteuriser with failures, s: the buffers behind it fill within a few minutes."""
PIECE = {"brewery": 20.0, "failures": 20.0, "hall": 2.0}
"""Line time between two lines of output, s."""
THREADS = {"brewery": 1, "failures": 1, "hall": None}

Reading = tuple[float, float, float]
"""Line time, processor time and wall time, s."""


def setting(name: str, seconds: float) -> tuple[Scene, Controller]:
    """Return a scene of `seconds`, and a new controller for it."""
    overrides = {"duration": seconds}
    if name == "hall":
        return load_scene(HALL, overrides), load("conveyor_sim.control.brewery:hall")
    if name == "brewery":
        return load_scene(BREWERY, overrides), load("conveyor_sim.control.brewery:brewery")
    program = StructuredText(BREWERY.with_suffix("") / "plc")
    return load_scene(BREWERY, overrides | {"parameters": {"dwell": DWELL}, "variant": "failures"}), program


def starts(scene: Scene) -> str:
    """Return the actions that press all start buttons for half a second."""
    buttons = [name for name, part in scene.panel.items() if name.endswith("start") and part.kind == "button"]
    actions = [f"{time},{action} {name}" for time, action in ((0.5, "press"), (1.0, "release")) for name in buttons]
    return "\n".join(("time,action", *actions, ""))


def measure(name: str, seconds: float, folder: Path) -> tuple[list[Reading], Path]:
    """Run a setting; return the clocks at the end of each piece, the first one at its first tick, and the recording."""
    scene, controller = setting(name, seconds)
    actions = folder / "actions.csv"
    actions.write_text(starts(scene))
    readings: list[Reading] = []

    def progress(simulated: float) -> None:
        if not readings or simulated >= readings[-1][0] + PIECE[name] - 0.5 * scene.tick:
            readings.append((simulated, time.process_time(), time.perf_counter()))

    run = run_scene(scene, folder / "run", progress, THREADS[name], controller, actions=actions)
    assert run.bag is not None
    return readings, run.bag


def bottles(bag: Path) -> Iterator[tuple[float, float]]:
    """Yield the recorded times, s, and the bottles on all conveyors."""
    with open_bag(bag) as opened:
        names = opened.line.signal_names
        counts = [place for place, one in enumerate(names) if one.startswith("belts/") and one.endswith("/bottles")]
        for frame in opened.read("signals"):
            yield frame.time, float(frame.data[counts].sum())


def main(name: str, seconds: float) -> None:
    """Measure a setting, and print the result."""
    with tempfile.TemporaryDirectory() as folder:
        readings, bag = measure(name, seconds, Path(folder))
        counted = list(bottles(bag))
        size = sum(file.stat().st_size for file in bag.rglob("*") if file.is_file())
    ticks = PIECE[name] / 0.01
    for (begin, used, wall), (end, later, end_wall) in pairwise(readings):
        present = [count for at, count in counted if begin <= at <= end]
        mean = sum(present) / len(present)
        print(
            f"{begin:5.0f} to {end:4.0f} s: {mean:.0f} bottles, {1e3 * (later - used) / ticks:.1f} ms a tick, "
            f"{mean * PIECE[name] / (end_wall - wall):.0f} bottles x real time"
        )
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(f"{1e-6 * size:.1f} MB recorded, {1e-3 * memory:.0f} MB of memory")


if __name__ == "__main__":
    main(sys.argv[1] if sys.argv[1:] else "brewery", float(sys.argv[2]) if sys.argv[2:] else 60.0)
