# SPDX-License-Identifier: Apache-2.0
"""Cost of reading a scene of very many bottles (docs/reliability.md): core time and memory, each in a process.

python docs/studies/large_scenes.py
"""

from __future__ import annotations

import resource
import subprocess
import sys
import time

from conveyor_sim.errors import SceneError
from conveyor_sim.scene import parse_scene

HEAD = """
name: many
duration: 1
contacts: [{between: [glass, glass], stiffness: 10000}]
base: [{between: [glass, chain], friction: 0.4}]
bottle_types: {bottle: {radius: 0.03, mass: 0.3, material: glass}}
belts: {belt: {kind: straight, start: [0, 0], angle: 0, length: 100, width: 100, speed: 0.1, material: chain}}
bottles:
"""
COLUMNS, PITCH = 1000, 0.0625  # m
CASES = (("listed", 10_000), ("listed", 100_000), ("listed", 300_000), ("in a grid", 300_000))


def text_of(how: str, bottles: int) -> str:
    """Return a scene of bottles in rows of COLUMNS."""
    if how == "in a grid":
        rows = bottles // COLUMNS
        grid = (
            f"{{type: bottle, origin: [0.1, 0.1], rows: {rows}, columns: {COLUMNS}, pitch: {PITCH}, pattern: square}}"
        )
        return f"{HEAD}  - {{grid: {grid}}}\n"
    places = (divmod(n, COLUMNS) for n in range(bottles))
    rows = (f"  - {{type: bottle, position: [{0.1 + x * PITCH}, {0.1 + y * PITCH}]}}\n" for y, x in places)
    return HEAD + "".join(rows)


def measure(how: str, bottles: int) -> None:
    """Read one scene and print the cost."""
    text = text_of(how, bottles)
    began, before = time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    try:
        parse_scene(text)
        what = "read"
    except SceneError as error:
        what = f"refused ({str(error).splitlines()[0]})"
    seconds = time.process_time() - began
    memory = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024e-6
    print(f"{bottles} bottles {how} ({len(text) * 1e-6:.1f} MB): {what}, {seconds:.1f} s of a core, {memory:.0f} MB")


if __name__ == "__main__":
    if len(sys.argv) == 3:
        measure(sys.argv[1], int(sys.argv[2]))
    else:
        for how, bottles in CASES:
            subprocess.run([sys.executable, __file__, how, str(bottles)], check=True)
