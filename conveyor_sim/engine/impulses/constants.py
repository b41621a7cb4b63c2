# SPDX-License-Identifier: Apache-2.0
"""Constants of a kind of contact at a substep of h: two bottle types, or a bottle type and a rail material.

With 1/m_n the inverse masses along the normal and 1/m_t those along the tangent, rotation included, an implicit step of
a spring k and a dashpot c has the compliance 1/(h^2 k), and 1/(1 + c/(h k)) of the overlap acts. A contact that the
substep resolves, h^2 k/m_n < RESOLVED, is such a step. Others take only CORRECTED of the remaining overlap as velocity,
because more would make long files oscillate, and the positions move apart by MOVED of it.
"""

import math
from typing import Any

from conveyor_sim.engine.arrays.impulses import CONSTANTS
from conveyor_sim.engine.compiler.compile import at, part

REACH, MASS, MASS_INVERSE, TURN, TURN_INVERSE = 0, 1, 2, 3, 4
OPEN, CLOSED, GAIN_OPEN, GAIN_CLOSED, COMPLIANCE = 5, 6, 7, 8, 9
REBOUND, FRICTION, APART, FASTEST, PEAK = 10, 11, 12, 13, 14

RESOLVED = 4.0
CORRECTED = 2e-4
MOVED = 0.2

OVER_ONE, OVER = 1.2, 1.4
"""Over-relaxation with one sweep, and with more. From 4/3 on, single sweeps diverge."""

CORRECTION_SPEED = 0.2
"""Largest speed at which an overlap is corrected, m/s."""

UNLIMITED = 1e9


@part
def fill_constants(world: Any, impulses: Any, h: float) -> None:
    """Fill both tables of constants for substeps of h (s)."""
    _fill_pairs(world.pair_law, impulses, h)
    _fill_rails(world.rail_law, world.settings.rail_materials, impulses, h)


@part
def _fill_pairs(law: Any, impulses: Any, h: float) -> None:
    if law is None:
        return
    types = impulses.types
    for a in range(types):
        for b in range(types):
            kind = a * types + b
            mass = impulses.inverse_mass[a] + impulses.inverse_mass[b]
            turn = mass + impulses.turning[a] + impulses.turning[b]
            table, row = impulses.pair_constants, CONSTANTS * kind
            table[row + REACH] = impulses.radius[a] + impulses.radius[b]
            _fill(table, row, law, kind, mass, turn, impulses.pair_restitution[kind], impulses.sweeps, h)
            table[row + PEAK] = impulses.pair_peak[kind] * math.sqrt(law.stiffness[kind] / mass)


@part
def _fill_rails(law: Any, materials: int, impulses: Any, h: float) -> None:
    if law is None:
        return
    for a in range(impulses.types):
        for b in range(materials):
            kind = a * materials + b
            mass = impulses.inverse_mass[a]
            turn = mass + impulses.turning[a]
            table, row = impulses.rail_constants, CONSTANTS * kind
            table[row + REACH] = impulses.radius[a]
            _fill(table, row, law, kind, mass, turn, impulses.rail_restitution[kind], impulses.sweeps, h)
            table[row + PEAK] = impulses.rail_peak[kind] * math.sqrt(law.stiffness[kind] / mass)


@part
def _fill(
    table: Any, row: int, law: Any, kind: int, mass: float, turn: float, restitution: float, sweeps: int, h: float
) -> None:
    k = law.stiffness[kind]
    resolved = h * h * k * mass < RESOLVED
    corrected = 1.0 if resolved else CORRECTED
    over = 1.0 if resolved else (OVER_ONE if sweeps == 1 else OVER)
    acting = 1.0 / (1.0 + _coefficient(at(law.damping_normal, kind)) / (h * k))
    table[row + MASS] = mass
    table[row + MASS_INVERSE] = 1.0 / mass
    table[row + TURN] = turn
    table[row + TURN_INVERSE] = 1.0 / turn
    table[row + OPEN] = acting / h
    table[row + CLOSED] = corrected * acting / h
    table[row + GAIN_OPEN] = over / (mass + acting / (h * h * k))
    table[row + GAIN_CLOSED] = over / (mass + corrected * acting / (h * h * k))
    table[row + COMPLIANCE] = 1.0 / (h * k)
    table[row + REBOUND] = (1.0 + restitution) / mass
    table[row + FRICTION] = _coefficient(at(law.friction, kind)) * turn
    table[row + APART] = 0.0 if resolved else MOVED / mass
    table[row + FASTEST] = UNLIMITED if resolved else CORRECTION_SPEED


@part
def _coefficient(value: Any) -> float:
    if value is None:
        return 0.0
    return value
