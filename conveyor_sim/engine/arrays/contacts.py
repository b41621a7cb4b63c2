"""Contacts of bottles: laws, pairs, tangential springs."""

from collections import namedtuple
from typing import Any, NamedTuple

from conveyor_sim.engine.arrays.integrators import PairTangent, Triple
from conveyor_sim.engine.arrays.types import F8, I8, U4
from conveyor_sim.engine.compiler.groups import group
from conveyor_sim.engine.contact.laws import DAMPING, ELASTIC


def _with_columns() -> Any:
    names = [law.column for law in ELASTIC] + [law.column for law in DAMPING]
    names += ["friction", "tangential_stiffness", "tangential_mindlin", "tangential_damping"]
    return namedtuple("_with_columns", names, defaults=[None] * len(names))


@group
class ContactLaw(_with_columns()):  # type: ignore[misc]
    """Coefficients of contact as flat columns; None where no contact of the scene has that law.

    As a table by type: (T * T,), entry a * T + b, or (T * M,), entry type * M + material. By pair: (P,). What a contact
    does not have is 0 in the column, for the laws add up. First the columns of the laws in `contact/laws/`, then

    - friction: mu
    - tangential_stiffness: N/m, of the spring with history; 0, not None, where only Mindlin's springs are
    - tangential_mindlin: N/m^1.5, times sqrt(delta): what overlap adds to that stiffness
    - tangential_damping: kg/s, beside that spring
    """

    __slots__ = ()


@group
class Curves(NamedTuple):
    """Tables of normal force against overlap, one behind the other."""

    start: U4
    """Curve c is entries start[c]:start[c + 1]; the first of them is (0, 0)."""
    overlap: F8
    force: F8


@group
class PairSprings(NamedTuple):
    """Tangential springs of the pairs, (P,), and a copy by pair that outlives a rebuild of the list."""

    elongation: F8
    """m, along the tangent; positive slip lengthens it."""
    kept_i: U4
    kept_j: U4
    kept: F8
    kept_count: I8
    """(1,)"""


@group
class PairParts(NamedTuple):
    """What of the pair forces does not give its work back, (2 P + 1,) as `Pairs.fx` (`ledger.py`)."""

    damping: Triple
    """N, N, N m."""
    friction: Triple


@group
class Pairs(NamedTuple):
    """Verlet list of bottle pairs, sorted by (i, j), i < j, (P,) by capacity. Explained in `pairs.py`."""

    i: U4
    j: U4
    reach: F8 | None
    """R_i + R_j, m; absent when all radii are equal."""
    radius_i: F8 | None
    """R_i, likewise."""
    law: ContactLaw
    used: I8
    """(1,), pairs in use."""
    fx: F8
    """N, (2 P + 1,): on i at p, on j at P + p, and a last entry that stays 0."""
    fy: F8
    moment: F8 | None
    """N m, likewise."""
    normal: F8 | None
    """N, likewise; for peaks."""
    touch: F8 | None
    """1 for a closed contact, likewise; for the implicit solver."""
    spring: PairSprings | None
    tangent: PairTangent | None
    parts: PairParts | None


@group
class Gathered(NamedTuple):
    """Scratch: what a block of pairs needs to know of its bottles."""

    difference: F8
    """(4 * BLOCK,), x, y, vx, vy of j less those of i, side by side."""
    turn: F8
    """(BLOCK,), omega of i and of j together, rad/s."""
    rim: F8
    """(BLOCK,), R omega of i and of j together, m/s, where radii differ."""
    compliance: F8
    """(BLOCK,), dt/m_t, s/kg, for the implicit solver."""
    way: F8
    """(4 * BLOCK,), how far j has gone less i, x and y (m), how far both have turned (rad), and their rims (m)."""


@group
class Slots(NamedTuple):
    """Which entries of the pair forces act on each bottle; explained in `slots.py`."""

    entry: U4
    """(S * WIDTH,), by bottle, in order of the partner; unused ones point at the entry that stays 0."""
    filled: U4
    """(S,), entries of each bottle."""
    more_start: U4
    """(S + 1,), entries beyond WIDTH of bottle i are more_start[i]:more_start[i + 1]."""
    more_bottle: U4
    more_entry: U4


@group
class Implicit(NamedTuple):
    """For friction solved implicitly, (S,)."""

    mobility: F8
    """1/m + R^2/J, 1/kg."""
    closed: F8
    """Closed contacts of each bottle, its base among them."""
    compliance: F8
    """dt times mobility times closed contacts, s/kg, times `Settings.ahead`."""
