# SPDX-License-Identifier: Apache-2.0
"""One contact in the linearly implicit method: force at the predicted state, resistance to a change of velocity.

A step of h from (r, v) changes v by dv and takes forces at r + theta h (v + theta dv) and v + theta dv, linear in dv:
    (M + theta^2 h^2 K + theta h C) dv = h F(r + theta h v, v)
with K and C symmetric and positive semidefinite: for each contact its stiffness along the normal, its damping, and the
slope of its friction. The rotation of normals and the change of friction with the normal force are omitted; they are of
a higher order. Slopes are differences of `contact_force`, so every law has them, and no law is written twice.

In steps longer than a contact, theta > 1/2, three things differ, by `late` = 2 theta - 1:
- A contact that was closed before the step and is open ahead is retained, or a packing at rest would come loose.
- Friction uses the normal force before the step: ahead, with deep overlaps, bottles would press far too hard.
- Friction and damping use the secant, force over slip, instead of the slope, if a step could reverse a slip.
"""

from conveyor_sim.engine.arrays.contacts import ContactLaw
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.contact.contact import contact_force

DIFFERENCE = 1e-6
"""Share of an overlap, or of v_lim, over which slopes are computed."""

CONTACTS = 12.0
"""Contacts of a bottle that may act together: six in a hexagonal packing, and six more for its base."""


@part
def linear_contact(
    world: World,
    law: ContactLaw,
    e: int,
    overlaps: tuple[float, float],
    share: float,
    closing: tuple[float, float],
    slip: float,
    mobility: tuple[float, float],
    step: tuple[float, float],
    hold: bool,
) -> tuple[float, float, float, float, float]:
    """Return N and T (N) ahead, the resistance to dv along n and t (kg), and N before the step.

    overlaps: m, before the step and ahead; 0 or less: apart. share, closing, slip: as in `contact_force`, closing
    before and ahead. mobility: 1/kg, closing speed and slip per unit of impulse. step: dt, s, and theta.
    """
    curves, slip_limit, atan = world.curves, world.settings.slip_limit, world.settings.atan
    before, ahead = overlaps
    dt, theta = step
    late = 2.0 * theta - 1.0
    least = DIFFERENCE * slip_limit
    speed = abs(slip) if abs(slip) > least else least
    faster = speed + least
    normal, drag = contact_force(law, e, curves, slip_limit, atan, ahead, share, closing[1], speed, None, None)
    _, drag_faster = contact_force(law, e, curves, slip_limit, atan, ahead, share, closing[1], faster, None, None)
    normal_before, old = contact_force(law, e, curves, slip_limit, atan, before, share, closing[0], speed, None, None)
    _, old_faster = contact_force(law, e, curves, slip_limit, atan, before, share, closing[0], faster, None, None)
    held = hold and normal <= 0.0
    depth = ahead
    if held:
        depth = before if before > 1e-9 else 1e-9
    stiffness, damping, elastic = _slopes(world, law, e, depth, share)
    if held:
        normal = elastic + stiffness * (ahead - depth) + damping * closing[1]
    acts = 1.0 if normal != 0.0 else 0.0
    drag += late * (old - drag)
    drag_faster += late * (old_faster - drag_faster)
    along = dt * dt * theta * theta * stiffness + resistance(dt * damping, dt * damping, theta, CONTACTS * mobility[0])
    across = resistance(dt * (drag - drag_faster) / least, -dt * drag / speed, theta, CONTACTS * mobility[1])
    return normal, drag * (slip / speed), acts * along, across, normal_before


@part
def resistance(slope: float, secant: float, theta: float, mobility: float) -> float:
    """Return the resistance (kg) from a force's slope over velocity and its quotient by velocity, both times dt (kg).

    It is theta times the slope, as in the method, plus as much of the secant as prevents the step from reversing the
    velocity. mobility: 1/kg, velocity per unit of impulse, times the number of contacts that may act together.
    """
    return theta * slope + firmness(secant * mobility) * (secant - theta * slope)


@part
def firmness(turns: float) -> float:
    """Return the share of the secant that is needed. turns: velocity change by the force alone, over the velocity."""
    return 1.0 - 1.0 / turns if turns > 1.0 else 0.0


@part
def contact_stiffness(world: World, law: ContactLaw, e: int, depth: float, share: float) -> float:
    """Return the slope of the elastic force over the overlap, N/m, at a depth in m; 0 apart."""
    stiffness, _, _ = _slopes(world, law, e, depth, share)
    return stiffness


@part
def _slopes(world: World, law: ContactLaw, e: int, depth: float, share: float) -> tuple[float, float, float]:
    """Return slopes of N over overlap at rest (N/m) and closing speed (kg/s), unclamped, and N at rest (N)."""
    if not depth > 0.0:
        return 0.0, 0.0, 0.0
    curves, slip_limit, atan = world.curves, world.settings.slip_limit, world.settings.atan
    step = DIFFERENCE * depth
    rest, _ = contact_force(law, e, curves, slip_limit, atan, depth, share, 0.0, 0.0, None, None)
    deeper, _ = contact_force(law, e, curves, slip_limit, atan, depth + step, share, 0.0, 0.0, None, None)
    closing, _ = contact_force(law, e, curves, slip_limit, atan, depth, share, slip_limit, 0.0, None, None)
    return (deeper - rest) / step, (closing - rest) / slip_limit, rest
