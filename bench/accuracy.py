# SPDX-License-Identifier: Apache-2.0
"""Waiting time for the accuracy of a scene: the first answer, a measured one, the end of the study."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time

from bench.markdown import table as markdown
from bench.measure import Effort, say
from bench.rows import Row, Rows
from conveyor_sim.accuracy.report import interim
from conveyor_sim.accuracy.session import ANSWER as END

CASE = "accuracy"
PREDICTED, PRELIMINARY, ANSWER = "s to the predicted answer", "s to a preliminary one", "s to the end"
SCENES = ("scenarios/zoned_line", "accumulation_table")
"""A line with photo-eyes, and 300 bottles that press on each other."""
HEADS = {interim.PREDICTED: PREDICTED, interim.PRELIMINARY: PRELIMINARY, END: ANSWER}
"""The line that begins each answer."""


def measure(effort: Effort) -> list[Row]:
    """Each scene by the command; a process before it, ended with its preliminary answer, has compiled the kernels."""
    rows = []
    for name in SCENES[:1] if effort.quick else SCENES:
        with tempfile.TemporaryDirectory() as folder:
            say(f"accuracy, to compile: {name}")
            _answers(name, os.path.join(folder, "compiled"), PRELIMINARY)
            say(f"accuracy: {name}")
            found = _answers(name, os.path.join(folder, "study"), PRELIMINARY if effort.quick else ANSWER)
        rows += [Row(CASE, 0.0, name, what, 0, seconds) for what, seconds in found.items()]
    return rows


def _answers(scene: str, folder: str, until: str) -> dict[str, float]:
    """Return the wall time from the start of the command to each awaited answer, s."""
    command = [sys.executable, "-c", "from conveyor_sim.cli import main; main()", "accuracy", scene, "--out", folder]
    found: dict[str, float] = {}
    start = time.perf_counter()
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            what = HEADS.get(line.strip())
            if what is not None:
                found[what] = time.perf_counter() - start
            if what == until != ANSWER:
                process.kill()
                return found
    if process.returncode:
        raise RuntimeError(f"conveyor-sim accuracy {scene} ended with {process.returncode}")
    # The pictures and the numbers come after the answer.
    return {**found, ANSWER: time.perf_counter() - start}


def tables(rows: Rows) -> str:
    """Return a table with one line per scene."""
    quantities = (PREDICTED, PRELIMINARY, ANSWER)
    body = [[name, *(rows.spread(CASE, 0.0, name, what) for what in quantities)] for name in rows.contestants(CASE)]
    return markdown(["", *quantities], body)
