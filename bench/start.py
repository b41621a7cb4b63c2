# SPDX-License-Identifier: Apache-2.0
"""From the start of a process to the first step of the paper's plant: kernels compiled, or found in the cache."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time

from bench.markdown import table as markdown
from bench.measure import Effort, say
from bench.rows import Row, Rows

CASE = "start"
SECONDS = "s to the first step"
COLD, CACHED = "cold", "cached"
COLD_REPEATS, CACHED_REPEATS = 2, 7
# The first step is the first tick: time passes in whole ticks.
CODE = """
from conveyor_sim import Simulation, load_scene
from conveyor_sim.support.resources import scene_path
simulation = Simulation(load_scene(scene_path("paper_plant")))
simulation.advance(1)
print(simulation.tick, flush=True)
"""


def measure(effort: Effort) -> list[Row]:
    """Measure some processes with an empty cache, then some with a filled one."""
    rows = []
    for turn in range(1 if effort.quick else COLD_REPEATS):
        with tempfile.TemporaryDirectory() as cache:
            say(f"start, cold, {turn + 1}")
            rows.append(Row(CASE, 0.0, COLD, SECONDS, turn, _first_step(cache)))
            for repeat in range(2 if effort.quick else CACHED_REPEATS):
                say(f"start, cached, {turn + 1}.{repeat + 1}")
                rows.append(Row(CASE, 0.0, CACHED, SECONDS, turn * CACHED_REPEATS + repeat, _first_step(cache)))
    return rows


def _first_step(cache: str) -> float:
    """s, until the process says that it has made it."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": cache}
    start = time.perf_counter()
    with subprocess.Popen([sys.executable, "-c", CODE], env=environment, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        said = process.stdout.readline()
        took = time.perf_counter() - start
    if said.strip() != "1" or process.returncode:
        raise RuntimeError(
            f"a process that was to make its first step said {said!r} and ended with {process.returncode}"
        )
    return took


def tables(rows: Rows) -> str:
    """One table."""
    body = [[name, rows.spread(CASE, 0.0, name, SECONDS)] for name in rows.contestants(CASE)]
    return markdown(["The paper's plant", SECONDS], body)
