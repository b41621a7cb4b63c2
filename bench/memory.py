# SPDX-License-Identifier: Apache-2.0
"""Memory of a bottle: arrays of the simulation, and what the process grows by."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np

from bench import ours
from bench.markdown import table as markdown
from bench.measure import Effort, say
from bench.packed import table as dense_table
from bench.rows import Row, Rows

CASE = "memory"
SIZES = (1_000, 10_000, 100_000)
EFFECTS = ("paper", "everything")
ARRAYS, PROCESS = "arrays, bytes per bottle", "process, bytes per bottle"
CODE = "from bench.memory import child; child({n}, {effects!r})"


def measure(effort: Effort) -> list[Row]:
    """Each size in a process of its own; the process's growth is taken over that for a tenth of the bottles."""
    rows = []
    for effects in EFFECTS:
        for n in SIZES[: 2 if effort.quick else None]:
            say(f"memory, {n} bottles, {effects}")
            small, large = (_child(count, effects) for count in (n // 10, n))
            rows.append(Row(CASE, n, effects, ARRAYS, 0, large[0] / n))
            rows.append(Row(CASE, n, effects, PROCESS, 0, (large[1] - small[1]) / (n - n // 10)))
    return rows


def _child(n: int, effects: str) -> tuple[int, int]:
    """Bytes of arrays, and resident bytes."""
    done = subprocess.run(
        [sys.executable, "-c", CODE.format(n=n, effects=effects)], stdout=subprocess.PIPE, text=True, check=True
    )
    arrays, process = done.stdout.split()
    return int(arrays), int(process)


def child(n: int, effects: str) -> None:
    """Print both numbers for one simulation, after its first ticks."""
    simulation = ours.simulate(dense_table(n, effects), threads=1)
    simulation.advance(2)
    print(array_bytes(simulation), resident())


def array_bytes(thing: object) -> int:
    """Return the bytes of all NumPy arrays reachable from an object; views count as their bases."""
    buffers: dict[int, int] = {}
    seen: set[int] = set()
    waiting = [thing]
    while waiting:
        here = waiting.pop()
        if id(here) in seen:
            continue
        seen.add(id(here))
        if isinstance(here, np.ndarray):
            base: Any = here
            while isinstance(base.base, np.ndarray):
                base = base.base
            buffers[id(base)] = base.nbytes
        else:
            waiting.extend(_parts(here))
    return sum(buffers.values())


def _parts(thing: object) -> Iterator[object]:
    if isinstance(thing, dict):
        yield from thing.values()
    elif isinstance(thing, (list, tuple, set, frozenset)):
        yield from thing
    elif type(thing).__module__.startswith(("conveyor_sim", "bench")):
        yield from getattr(thing, "__dict__", {}).values()


def resident() -> int:
    """Bytes of this process in memory."""
    with open("/proc/self/status") as file:
        return next(1024 * int(line.split()[1]) for line in file if line.startswith("VmRSS:"))


def tables(rows: Rows) -> str:
    """One table."""
    columns = [(effects, what) for effects in EFFECTS for what in (ARRAYS, PROCESS)]
    body = []
    for n in rows.ns(CASE):
        found = [rows.spread(CASE, n, effects, what) for effects, what in columns]
        body.append([f"N = {n:g}", *(spread and f"{spread.middle:.0f}" for spread in found)])
    head = ["", *(f"{effects}: {what}" for effects, what in columns)]
    return f"{markdown(head, body)}\n\nThe process also holds the scene, and memory of NumPy and numba."
