# SPDX-License-Identifier: Apache-2.0
"""Runs of awake bottles in adjacent slots, which the loops over bottles visit while others sleep (`sleep.py`)."""

from typing import Any

from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.threads.workers import UNIT


@part
def plan_runs(bottles: Any, sleep: Any) -> None:
    """List the runs of awake bottles of each unit of slots. Free slots belong to none."""
    slots, count = bottles.id.size, 0
    for unit in range((slots + UNIT - 1) // UNIT):
        sleep.first_run[unit] = count
        i, end = unit * UNIT, min(unit * UNIT + UNIT, slots)
        while i < end:
            if sleep.asleep[i] != 0 or bottles.id[i] < 0:
                i += 1
                continue
            sleep.run_begin[count] = i
            while i < end and sleep.asleep[i] == 0 and bottles.id[i] >= 0:
                i += 1
            sleep.run_end[count] = i
            count += 1
    sleep.first_run[(slots + UNIT - 1) // UNIT] = count


@part
def runs_from(sleep: Any, first: int) -> int:
    """Return the first run of a block that begins at a slot."""
    if sleep is None:
        return 0
    return int(sleep.first_run[first // UNIT]) if sleep.sleepers[0] > 0 else 0


@part
def runs_to(sleep: Any, end: int) -> int:
    """Return the run after the last of a block that ends before a slot. A block without sleepers is one run."""
    if sleep is None:
        return 1
    return int(sleep.first_run[(end + UNIT - 1) // UNIT]) if sleep.sleepers[0] > 0 else 1


@part
def run_of(sleep: Any, first: int, end: int, run: int) -> tuple[int, int]:
    """Return the slots of a run of the block first to end: the first, and the one after the last."""
    if sleep is None:
        return first, end
    return (int(sleep.run_begin[run]), int(sleep.run_end[run])) if sleep.sleepers[0] > 0 else (first, end)


@part
def sleeps(sleep: Any, i: int) -> bool:
    """Return True if bottle i sleeps."""
    if sleep is None:
        return False
    return sleep.asleep[i] != 0


@part
def end_of_awake(sleep: Any, pairs: Any, colour: int) -> int:
    """Return the end of the pairs of a colour that are swept."""
    if sleep is None:
        return int(pairs.start[colour + 1])
    return int(sleep.end[colour])
