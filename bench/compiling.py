# SPDX-License-Identifier: Apache-2.0
"""Cost of the first run of a kind of scene: processor time to the first tick, without cached kernels."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from bench.markdown import table as markdown
from bench.measure import Effort, say
from bench.rows import Row, Rows

ROOT = Path(__file__).resolve().parent.parent
BEFORE = ROOT / "docs" / "performance" / "compile_before.csv"
"""Measurements at the commit before the line's sensors were compiled."""

CASE = "compile"
SECONDS = "s of a core to the first tick"
FIRST = ("paper_plant", "turntable", "zoned_line")
"""Each in a process of its own, then all in one."""
SECOND, THIRD = "turntable, after paper_plant", "zoned_line, after these two"
KEPT = "turntable, in a new process, paper_plant's kernels kept"
OWN = {SECOND: "turntable", THIRD: "zoned_line"}
"""Whose first tick alone a later one is held against."""
ROUNDS = 2
CODE = """
import sys, time
import numba
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.resources import scene_path
for name in sys.argv[1:]:
    path = scene_path("scenarios/" + name if name == "zoned_line" else name)
    begin = time.process_time()
    Simulation(load_scene(path), threads=1).advance(1)
    print(time.process_time() - begin, flush=True)
"""


def measure(effort: Effort) -> list[Row]:
    """Measure new processes with an empty cache, except for the last."""
    rows = []
    for turn in range(1 if effort.quick else ROUNDS):
        for name in FIRST[:1] if effort.quick else FIRST:
            rows += _measured(turn, [name], [name])
        if not effort.quick:
            rows += _measured(turn, FIRST, [None, SECOND, THIRD])
            with tempfile.TemporaryDirectory() as cache:
                _first_ticks(["paper_plant"], cache)
                rows += _measured(turn, ["turntable"], [KEPT], cache)
    return rows


def _measured(
    turn: int, scenes: Sequence[str], contestants: Sequence[str | None], cache: str | None = None
) -> list[Row]:
    say(f"compile, round {turn + 1}: {', '.join(scenes)}")
    with tempfile.TemporaryDirectory() as empty:
        found = _first_ticks(scenes, cache or empty)
    return [
        Row(CASE, 0.0, contestant, SECONDS, turn, seconds)
        for contestant, seconds in zip(contestants, found, strict=True)
        if contestant is not None
    ]


def _first_ticks(scenes: Sequence[str], cache: str) -> list[float]:
    """Return the processor time of first ticks, s, for scenes in sequence in one process, without numba's import."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": cache}
    command = [sys.executable, "-c", CODE, *scenes]
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    return [float(line) for line in done.stdout.split()]


def of_before(rows: Rows, name: str) -> float | None:
    """Return the ratio of a scene's first tick to that of the earlier commit; None if it wasn't measured."""
    now = rows.spread(CASE, 0.0, name, SECONDS)
    before = Rows.read(BEFORE).spread(CASE, 0.0, OWN.get(name, name), SECONDS)
    return None if now is None or before is None else now.middle / before.middle


def tables(rows: Rows) -> str:
    """One table, with what was measured before."""
    before = Rows.read(BEFORE)
    body = []
    for name in rows.contestants(CASE):
        share = of_before(rows, name)
        then, now = (found.spread(CASE, 0.0, name, SECONDS) for found in (before, rows))
        body.append([name, then, now, None if share is None else f"{share:.2f}"])
    return markdown([SECONDS, "before", "now", "of the scene's own first tick before"], body)
