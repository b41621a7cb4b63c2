# SPDX-License-Identifier: Apache-2.0
"""Contacts of bottles: laws, pairs, tangential springs."""

from collections import namedtuple
from typing import Any, NamedTuple

from conveyor_sim.engine.arrays.impulses import PairImpulses
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
    """Coefficients of contact as flat columns; None if no contact of the scene has that law.

    As a table by type: (T * T,), entry a * T + b, or (T * M,), entry type * M + material. By pair: (P,). A contact
    without a law has 0 in its column (tables: -1), because the laws are added up. The columns of the laws in
    `contact/laws/` are followed by

    - friction: mu
    - tangential_stiffness: N/m, of the spring with history; 0, not None, if there are only Mindlin springs
    - tangential_mindlin: N/m^1.5, times sqrt(delta): stiffness added by the overlap
    - tangential_damping: kg/s, parallel to that spring
    """

    __slots__ = ()


@group
class Curves(NamedTuple):
    """Tables of normal force against overlap, one after the other."""

    start: U4
    """Curve c consists of entries start[c]:start[c + 1]; the first of them is (0, 0)."""
    overlap: F8
    force: F8


@group
class PairSprings(NamedTuple):
    """Tangential springs of the pairs, (P,), and a copy by pair that survives a rebuild of the list."""

    elongation: F8
    """Elongation along the tangent, m; positive slip lengthens it. A pair without a spring has its friction of the last
    evaluation here, N, if implicit friction starts from it (`EngineSettings.warm`)."""
    kept_i: U4
    kept_j: U4
    kept: F8
    kept_count: I8
    """(1,)"""


@group
class PairParts(NamedTuple):
    """Dissipative parts of the pair forces, (2 P + 1,) as `Pairs.fx` (`ledger.py`)."""

    damping: Triple
    """N, N, N m."""
    friction: Triple


@group
class Pairs(NamedTuple):
    """Verlet list of bottle pairs, sorted by (i, j), i < j, (P,) by capacity. Explained in `pairs.py`."""

    i: U4
    j: U4
    reach: F8 | None
    """R_i + R_j, m; absent if all radii are equal."""
    radius_i: F8 | None
    """R_i, m; absent if all radii are equal."""
    law: ContactLaw
    used: I8
    """Number of pairs in use, (1,)."""
    fx: F8
    """Force in N, (2 P + 1,): on i at p, on j at P + p; the last entry stays 0."""
    fy: F8
    moment: F8 | None
    """Moment in N m, laid out like `fx`."""
    normal: F8 | None
    """Normal force in N, laid out like `fx`; for peaks."""
    touch: F8 | None
    """1 for a closed contact, laid out like `fx`; for the implicit solver."""
    spring: PairSprings | None
    tangent: PairTangent | None
    impulse: PairImpulses | None
    parts: PairParts | None


@group
class Gathered(NamedTuple):
    """Scratch: data of the bottles of a block of pairs."""

    difference: F8
    """x, y, vx, vy of j minus those of i, side by side, (4 * BLOCK,)."""
    turn: F8
    """omega of i plus that of j, rad/s, (BLOCK,)."""
    rim: F8
    """R omega of i plus that of j, m/s, for different radii, (BLOCK,)."""
    compliance: F8
    """Sum of `Implicit.compliance` of both bottles, s/kg, (BLOCK,)."""
    kick: F8
    """`Implicit.kick` of j minus that of i, laid out as `displacement`, (4 * BLOCK,)."""
    displacement: F8
    """Displacements of j minus those of i: x, y (m); sums of rotations (rad) and rim displacements (m), (4 * BLOCK,).
    """


@group
class Slots(NamedTuple):
    """Entries of the pair forces that act on each bottle; explained in `slots.py`."""

    entry: U4
    """Entries by bottle, in order of the partner, (S * WIDTH,); unused ones point at the entry that stays 0."""
    filled: U4
    """Number of entries of each bottle, (S,)."""
    more_start: U4
    """Entries beyond WIDTH of bottle i are more_start[i]:more_start[i + 1], (S + 1,)."""
    more_bottle: U4
    more_entry: U4


@group
class Implicit(NamedTuple):
    """Data of the implicit friction solver, (S,)."""

    mobility: F8
    """1/m + R^2/J, 1/kg."""
    closed: F8
    """Number of closed contacts, including the base."""
    compliance: F8
    """dt times mobility times closed contacts, s/kg, times `EngineSettings.ahead`."""
    kick: Triple | None
    """Change of velocity in the last step, m/s, m/s, rad/s. None: forces are evaluated at predicted velocities."""
