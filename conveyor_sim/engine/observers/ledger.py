# SPDX-License-Identifier: Apache-2.0
"""Accounts of the energy ledger: the work of forces, added up in every step.

An evaluation of the forces leaves their parts (`ledger_parts.py`). A part's power is that force times a velocity,
summed over the bottles of a unit (`workers.py`) by one thread in their order, so sums do not depend on the threads.

A kick, v += h F/m, is booked with the mean of the velocities before and after it. The change of kinetic energy is then
exactly the sum of all powers times h. The Runge-Kutta methods book each stage with its own velocity and the method's
weight, so that the accounts are integrated as the motion is. Elastic forces are not booked, because the energy of
springs follows from the state (`stored_energy.py`). The difference between that and the accounts is the integrator's
error.
"""

from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.bodies import Bottles, ForceSums
from conveyor_sim.engine.arrays.observers import LedgerArrays
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.threads.workers import UNIT, units

DAMPING, CONTACT_FRICTION, BASE_FRICTION, BELTS = 0, 1, 2, 3
"""Columns of the accounts: dissipated energy, then the work of each belt, then that of each moving rail."""


@part
def note_powers(
    bottles: Bottles, spin: Any, load: ForceSums, ledger: Any, ahead: float, stage: int, first: int, end: int
) -> None:
    """Compute the power of each account on bottles first to end at velocities `ahead` (s) after the present ones."""
    if ledger is None:
        return
    begin, stop = units(first, end)
    for unit in range(begin, stop):
        last = min((unit + 1) * UNIT, end)
        belts = 0.0
        for h in range(ledger.belt_power.shape[1]):
            belts += ledger.belt_power[unit, h]
            ledger.power[stage, unit, BELTS + h] = ledger.belt_power[unit, h]
        damping, friction, base = _powers(bottles, spin, load, ledger, ahead, unit * UNIT, last)
        ledger.power[stage, unit, DAMPING] = -damping
        ledger.power[stage, unit, CONTACT_FRICTION] = -friction
        ledger.power[stage, unit, BASE_FRICTION] = belts - base
        _note_rails(ledger.power, ledger.rail_power, BELTS + ledger.belt_power.shape[1], stage, unit)


@part
def _note_rails(power: F8, rail_power: Any, first: int, stage: int, unit: int) -> None:
    """Store the power of each moving rail, and the losses by damping and friction. first: account of the first rail."""
    if rail_power is None:
        return
    rails = rail_power.shape[1] - 2
    for q in range(rails):
        power[stage, unit, first + q] = rail_power[unit, q]
    power[stage, unit, DAMPING] += rail_power[unit, rails]
    power[stage, unit, CONTACT_FRICTION] += rail_power[unit, rails + 1]


@part
def _powers(
    bottles: Bottles, spin: Any, load: ForceSums, ledger: LedgerArrays, ahead: float, first: int, end: int
) -> tuple[float, float, float]:
    """Return the powers of damping, contact friction and base on the bottles, W."""
    damping = friction = base = 0.0
    for i in range(uint64(first), uint64(end)):
        vx = bottles.vx[i] + ahead * (load.fx[i] * bottles.inverse_mass[i])
        vy = bottles.vy[i] + ahead * (load.fy[i] * bottles.inverse_mass[i])
        damping += ledger.damping.x[i] * vx + ledger.damping.y[i] * vy
        friction += ledger.friction.x[i] * vx + ledger.friction.y[i] * vy
        base += ledger.base.x[i] * vx + ledger.base.y[i] * vy
    if spin is not None:
        for i in range(uint64(first), uint64(end)):
            omega = spin.omega[i] + ahead * (spin.moment[i] * spin.inverse_inertia[i])
            damping += ledger.damping.turn[i] * omega
            friction += ledger.friction.turn[i] * omega
            base += ledger.base.turn[i] * omega
    return damping, friction, base


@part
def book(ledger: Any, stage: int, h: float, first: int, end: int) -> None:
    """Add the powers of a stage over h seconds to the accounts of bottles first to end."""
    if ledger is None:
        return
    begin, stop = units(first, end)
    for unit in range(begin, stop):
        for account in range(ledger.work.shape[1]):
            ledger.work[unit, account] += h * ledger.power[stage, unit, account]


@part
def book_kick(bottles: Bottles, spin: Any, load: ForceSums, ledger: Any, h: float, first: int, end: int) -> None:
    """Book a kick of h seconds that bottles first to end are about to get."""
    note_powers(bottles, spin, load, ledger, 0.5 * h, 0, first, end)
    book(ledger, 0, h, first, end)


@part
def book_stages(ledger: Any, weights: F8, h: float, first: int, end: int) -> None:
    """Book a step of h seconds of bottles first to end, weighted as the method weights accelerations."""
    last = weights.shape[0] - 1
    for stage in range(weights.shape[1]):
        # A stage without weight may be from a rejected step, and not finite.
        if weights[last, stage] != 0.0:
            book(ledger, stage, h * weights[last, stage], first, end)
