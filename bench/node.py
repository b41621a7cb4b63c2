# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 node on the dense table: what it costs beside the kernels, and how soon a command acts.

The node records and publishes all its topics at 50 Hz; another process subscribes to all of them. What the kernels
alone take is measured on a `Simulation` of the same scene in a process of its own, right before.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from bench import ours
from bench.markdown import table as markdown
from bench.measure import Effort, say
from bench.packed import TICK
from bench.packed import table as dense_table
from bench.rows import Row, Rows
from conveyor_sim.scene import Scene, load_scene

CASE = "node"
SIZES = (1_000, 10_000)
RATES = {topic: 0.0 if topic in ("ledger", "damage") else 50.0 for topic in Scene.TOPICS}
"""Hz. The kernels of ledger and damage alone take more than real time with so many bottles in contact."""
SETTLE = 1.0
"""s of simulated time before anything is measured: the table is packed by then."""
REAL_TIME, FREE = "at real time", "as fast as it goes"
OUTSIDE = "share of wall time outside the kernels"
OVERHEAD = "cores beside the kernels'"
"""s of a core a simulated second: so it is the same where the machine is too busy for real time."""
WHOLE = "cores of the node"
LATENCY = "ms from a command to its outcome"
PATIENCE = 120.0
"""s"""
KERNEL_CODE = "from bench.node import kernels; kernels({scene!r}, {ticks})"


def measure(effort: Effort) -> list[Row]:
    """Measure at full speed, and in real time where the kernels are fast enough."""
    try:
        import conveyor_msgs  # noqa: F401
        import rclpy  # noqa: F401
    except ImportError as error:
        say(f"the node is left out: {error}")
        return []
    from conveyor_sim.ros.domain import private_domain

    rows = []
    for n in SIZES[: 1 if effort.quick else None]:
        with tempfile.TemporaryDirectory() as folder, private_domain():
            rows += _one_size(n, effort, Path(folder))
    return rows


def _one_size(n: int, effort: Effort, folder: Path) -> list[Row]:
    scene = folder / "table.yaml"
    scene.write_text(dense_table(n, "paper").source_text)
    ticks = max(20, round((1.0 if effort.quick else 5.0) / TICK * min(1.0, 1_000 / n)))
    rows = []
    for turn in range(1 if effort.quick else min(3, effort.rounds)):
        say(f"node, {n} bottles, round {turn + 1}: kernels alone")
        wall, cpu = (total / ticks for total in _kernels(scene, ticks))
        for how, factor in ((FREE, 0.0), (REAL_TIME, 1.0)):
            if how == REAL_TIME and wall > 0.8 * TICK:
                continue  # out of reach, it would be the same again
            say(f"node, {n} bottles, round {turn + 1}: {how}")
            with _node(scene, folder / f"{how} {turn}".replace(" ", "_"), factor) as line:
                node_wall, node_cpu = line.per_tick(ticks)
                latencies = line.latencies(5 if effort.quick else 30)
            if how == FREE:
                rows.append(Row(CASE, n, how, OUTSIDE, turn, 1.0 - wall / node_wall))
            rows.append(Row(CASE, n, how, OVERHEAD, turn, (node_cpu - cpu) / TICK))
            rows.append(Row(CASE, n, how, WHOLE, turn, node_cpu / node_wall))
            first = turn * len(latencies)
            rows += [Row(CASE, n, how, LATENCY, first + i, 1e3 * took) for i, took in enumerate(latencies)]
    return rows


def _kernels(scene: Path, ticks: int) -> tuple[float, float]:
    """Wall and processor time, s, of so many ticks of a `Simulation` in a process of its own."""
    code = KERNEL_CODE.format(scene=str(scene), ticks=ticks)
    done = subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, check=True)
    wall, cpu = map(float, done.stdout.split())
    return wall, cpu


def kernels(scene: str, ticks: int) -> None:
    """Print wall and processor time of so many ticks after the table has settled."""
    simulation = ours.simulate(load_scene(scene, {"outputs": RATES}), threads=1)
    simulation.advance(round(SETTLE / TICK))
    wall, cpu = time.perf_counter(), time.process_time()
    simulation.advance(ticks)
    print(time.perf_counter() - wall, time.process_time() - cpu)


@contextmanager
def _node(scene: Path, folder: Path, factor: float) -> Iterator[Any]:
    """Yield a settled node with a listener; both end afterwards."""
    from bench.node_client import Line
    from conveyor_sim.ros.child import Child

    folder.mkdir()
    environment = {**os.environ, "ROS_LOG_DIR": str(folder / "ros")}
    given: dict[str, object] = {
        "scene": scene, "record": folder / "bag", "start_paused": True, "real_time_factor": factor, "threads": 1,
        **{f"rates.{topic}": rate for topic, rate in RATES.items()},
    }  # fmt: skip
    child = Child("sim_node", given, environment, folder)
    listener = subprocess.Popen([sys.executable, "-m", "bench.node_listener"], stdin=subprocess.PIPE)
    line = Line(child, TICK)
    try:
        line.settle(round(SETTLE / TICK), PATIENCE)
        yield line
    finally:
        line.close()
        child.stop()
        listener.communicate()


def tables(rows: Rows) -> str:
    """One table."""
    columns = [(FREE, OUTSIDE), *((how, what) for how in (REAL_TIME, FREE) for what in (OVERHEAD, WHOLE, LATENCY))]
    body = [[f"{what}, {how}", *(rows.spread(CASE, n, how, what) for n in rows.ns(CASE))] for how, what in columns]
    text = (
        "One thread. A command's outcome is published at the end of the tick in which the belt changed speed, and is "
        "received in another process. A case that does not reach real time has no figure. Cores "
        "beside the kernels' are seconds of a core per simulated second."
    )
    return f"{markdown(['', *(f'N = {n:g}' for n in rows.ns(CASE))], body)}\n\n{text}"
