# SPDX-License-Identifier: Apache-2.0
"""Duration of complete commands, with recording, summary and figures."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time

from bench.markdown import table as markdown
from bench.measure import Effort, say
from bench.rows import Row, Rows

CASE = "whole"
WALL, CPU = "s of wall time", "s of processor time, all processes"
RUN, MAKE_RUN = "conveyor-sim run paper_plant", "make run, without its set-up"
COMMANDS = {
    RUN: ["-c", "from conveyor_sim.cli import main; main()", "run", "paper_plant"],
    MAKE_RUN: ["-m", "conveyor_sim.ros.main_job", "paper_plant"],
}
ROUNDS = 3


def measure(effort: Effort) -> list[Row]:
    """Each command once, so that kernels are compiled, then some times."""
    rows = []
    for turn in range(-1, 1 if effort.quick else ROUNDS):
        for name, arguments in COMMANDS.items():
            say(f"whole, {f'round {turn + 1}' if turn >= 0 else 'to compile'}: {name}")
            wall, cpu = _run(arguments)
            if turn >= 0:
                rows += [Row(CASE, 0.0, name, WALL, turn, wall), Row(CASE, 0.0, name, CPU, turn, cpu)]
    return rows


def _run(arguments: list[str]) -> tuple[float, float]:
    """Wall and processor time, s, of 20 simulated seconds."""
    with tempfile.TemporaryDirectory() as folder:
        before, start = _children(), time.perf_counter()
        command = [sys.executable, *arguments, "--out", os.path.join(folder, "run")]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        return time.perf_counter() - start, _children() - before


def _children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def tables(rows: Rows) -> str:
    """One table."""
    body = [
        [name, *(rows.spread(CASE, 0.0, name, quantity) for quantity in (WALL, CPU))] for name in rows.contestants(CASE)
    ]
    return markdown(["", WALL, CPU], body)
