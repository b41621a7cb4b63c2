"""What looks on: the energy ledger and the guard."""

from typing import NamedTuple

from conveyor_sim.engine.arrays.integrators import Triple
from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.compiler.groups import group


@group
class Ledger(NamedTuple):
    """Where the work of forces goes (`ledger.py`); absent when nobody asks."""

    damping: Triple
    """(S,), N, N, N m, on each bottle in the last evaluation: of the damping in its contacts."""
    friction: Triple
    """(S,), likewise of the friction in its contacts, their tangential springs included."""
    base: Triple
    """(S,), likewise of what it stands on."""
    belt_power: F8
    """(units, H + 1), W, of each belt on a unit of bottles (`workers.py`) in the last evaluation; the floor is last."""
    rail_power: F8 | None
    """(units, Q + 2), W, of each moving rail, then what damping and friction take of it; None where no rail moves."""
    power: F8
    """(stages, units, BELTS + H + 1 + Q), W, of each account in each stage of a step."""
    work: F8
    """(units, BELTS + H + 1 + Q), J, the accounts, since the start."""


@group
class GuardProbe(NamedTuple):
    """The deepest overlaps since the guard last looked: of two bottles, and of a bottle with a rail."""

    depth: F8
    """(2,), over the (smaller) radius."""
    bottle: I8
    """(2,), slots; the lower one of two."""
    other: I8
    """(2,), slot of the other bottle; number of the rail."""
    due: I8
    """(1,), not 0: lists were made anew since."""
