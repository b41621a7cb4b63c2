# SPDX-License-Identifier: Apache-2.0
"""Arrays of sleeping bottles (`engine/impulses/sleep.py`); None if no bottle can sleep.

Shapes: S bottle slots, U units of slots, H belts, T bottle types. SI units.
"""

from typing import NamedTuple

from conveyor_sim.engine.arrays.types import F8, I8, U4
from conveyor_sim.engine.compiler.groups import group


@group
class SeenSurfaces(NamedTuple):
    """Surfaces of the last tick, by which a change is detected (`Surface`)."""

    ux: F8
    uy: F8
    turn: F8 | None


@group
class SleepLoads(NamedTuple):
    """Loads on sleepers by contacts that do not change, (S,); None without peaks."""

    largest: F8
    """Largest normal force, N."""
    total: F8
    """Sum of all normal forces, N."""


@group
class Sleep(NamedTuple):
    """Which bottles sleep, and since when the others have been quiet."""

    asleep: U4
    """1: the bottle sleeps, (S,)."""
    island: U4
    """Island of a sleeper: its first slot, (S,)."""
    quiet: U4
    """Ticks for which an awake bottle has been quiet, at most LONG, (S,)."""
    x: F8
    """Position at the start of the last tick that the bottle was awake, m, (S,)."""
    y: F8
    press: F8
    """Sum of the magnitudes of the forces of other bottles at that time, N, (S,)."""
    id: I8
    """Bottle that sleeps in a slot, (S,)."""
    type: U4
    loads: SleepLoads | None
    surfaces: SeenSurfaces | None
    sleepers: I8
    """Number of sleepers, (1,)."""
    ticks: I8
    """Sum over the ticks: bottles asleep, and bottles present, (2,)."""
    ahead: F8
    """Length of the tick that has begun, s, (1,); 0 between ticks."""
    end: I8
    """End of the pairs of each colour with an awake bottle, (COLOURS,)."""
    first_run: U4
    """First run of each unit of slots, (U + 1,). Scratch of a tick, as all below."""
    run_begin: U4
    """First slot of each run of awake bottles, (S,)."""
    run_end: U4
    mark: I8
    """(S,)"""
    root: U4
    """Island of each bottle, awake or asleep, (S,)."""
    noise: I8
    """1: a bottle of the island is not quiet, (S,)."""
    sum: F8
    """Present sum of these magnitudes, N, (S,)."""
