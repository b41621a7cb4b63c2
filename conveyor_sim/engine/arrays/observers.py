# SPDX-License-Identifier: Apache-2.0
"""Arrays of the energy ledger and the guard."""

from typing import NamedTuple

from conveyor_sim.engine.arrays.integrators import Triple
from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.compiler.groups import group


@group
class LedgerArrays(NamedTuple):
    """Work of forces by account (`ledger.py`); absent if the ledger is not requested."""

    damping: Triple
    """Damping in the contacts of each bottle in the last evaluation, N, N, N m, (S,)."""
    friction: Triple
    """Friction in the contacts, tangential springs included; as `damping`."""
    base: Triple
    """Forces of belts and floor; as `damping`."""
    belt_power: F8
    """Power of each belt on a unit of bottles (`workers.py`) in the last evaluation, W, (units, H + 1), the floor last.
    """
    rail_power: F8 | None
    """Power of each moving rail, then the losses by damping and by friction, W, (units, Q + 2); None without rails."""
    power: F8
    """Power of each account in each stage of a step, W, (stages, units, BELTS + H + 1 + Q)."""
    work: F8
    """Accounts since the start, J, (units, BELTS + H + 1 + Q)."""


@group
class GuardProbe(NamedTuple):
    """Deepest overlaps since the guard's last check: of two bottles, and of a bottle with a rail."""

    depth: F8
    """Overlap divided by the (smaller) radius, (2,)."""
    bottle: I8
    """Slots, (2,); the lower one of two."""
    other: I8
    """Slot of the other bottle, and number of the rail, (2,)."""
    due: I8
    """Not 0: lists have been rebuilt since, (1,)."""
