# SPDX-License-Identifier: Apache-2.0
"""Scans a second of a controller in lockstep, in a process of its own, over DDS; and how soon the first one comes."""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

from bench.markdown import table as markdown
from bench.measure import Effort, say
from bench.rows import Row, Rows
from conveyor_sim.ros.child import Child
from conveyor_sim.support.resources import scene_path

CASE = "lockstep"
SCENE = "reject_line"
SCANS, QUICK_SCANS, WARM = 5000, 500, 500
RATE = "scans a second"
NODE, CONTROLLER = "us of a core a scan, sim_node", "us of a core a scan, controller_node"
START = "s from the start of both to the first scans"
PATIENCE, LOOK = 300.0, 0.01
"""s"""


def measure(effort: Effort) -> list[Row]:
    """Measure some runs, each with two new processes."""
    try:
        import conveyor_msgs  # noqa: F401
        import rclpy  # noqa: F401
    except ImportError as error:
        say(f"lockstep is left out: {error}")
        return []
    from conveyor_sim.ros.domain import private_domain

    rows = []
    for turn in range(1 if effort.quick else effort.rounds):
        say(f"lockstep, round {turn + 1}")
        with tempfile.TemporaryDirectory() as folder, private_domain():
            rows += _run(Path(folder), QUICK_SCANS if effort.quick else SCANS, turn)
    return rows


def _run(folder: Path, scans: int, turn: int) -> list[Row]:
    marks = folder / "marks"
    environment = {**os.environ, "ROS_LOG_DIR": str(folder / "ros"), "PYTHONPATH": os.getcwd()}
    scene = {"scene": scene_path(f"scenarios/{SCENE}"), "start_paused": True, "real_time_factor": 0.0, "threads": 1}
    asked = f"{{path: {marks}, first: {WARM}, last: {WARM + scans}}}"
    controller = {"controller": "bench.counting_controller:make", "parameters": asked}
    start = time.perf_counter()
    node = Child("sim_node", {**scene, "duration": 0.01 * (WARM + scans + 10)}, environment, folder)
    other = Child("controller_node", controller, environment, folder)
    try:
        (wall, cpu), node_cpu = _mark(marks, 0, node, other)
        started = wall - start
        (end, cpu_end), node_end = _mark(marks, 1, node, other)
    finally:
        other.stop()
        node.stop()
    return [
        Row(CASE, 0.0, SCENE, RATE, turn, scans / (end - wall)),
        Row(CASE, 0.0, SCENE, NODE, turn, 1e6 * (node_end - node_cpu) / scans),
        Row(CASE, 0.0, SCENE, CONTROLLER, turn, 1e6 * (cpu_end - cpu) / scans),
        Row(CASE, 0.0, SCENE, START, turn, started - WARM * (end - wall) / scans),
    ]


def _mark(path: Path, line: int, node: Child, other: Child) -> tuple[tuple[float, float], float]:
    """Wall and processor time (s) of the controller at a mark, and the node's processor time soon after it."""
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:
        found = path.read_text().splitlines() if path.is_file() else []
        if len(found) > line:
            wall, cpu = map(float, found[line].split())
            return (wall, cpu), _processor_time(node.pid)
        for child in (node, other):
            if child.exit_code not in (None, 0):
                raise RuntimeError(child.obituary())
        time.sleep(LOOK)
    raise RuntimeError(f"no scan within {PATIENCE:g} s:\n{other.last_words()}")


def _processor_time(pid: int) -> float:
    """s, of a process with all its threads."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def tables(rows: Rows) -> str:
    """One table."""
    body = [[what, rows.spread(CASE, 0.0, SCENE, what)] for what in (RATE, NODE, CONTROLLER, START)]
    return markdown(["", f"`{SCENE}`"], body)
