# SPDX-License-Identifier: Apache-2.0
"""Force in one contact: elastic law, damping, friction (paper eqs. 22-23, 7-10, and further laws).

Between a and b, with the unit normal n from a to b and the tangent t = (-n_y, n_x): the force on a is -N n + T t, on b
its negative. Laws along the normal have one file each in `laws/`; `law_sums.py` adds them up.

There are no branches, so a loop over pairs is vectorised, and separated pairs get exactly 0. The only exception is a
tabulated law, which has branches.
"""

import math
from typing import Any

from conveyor_sim.engine.arrays.contacts import ContactLaw
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.contact.friction import friction_share, implicit_share
from conveyor_sim.engine.contact.law_sums import (
    add_damping,
    add_drag,
    add_elastic_energy,
    add_elastic_force,
    never_pull,
)


@part
def contact_force(
    law: ContactLaw,
    e: int,
    curves: Any,
    slip_limit: float,
    atan: Any,
    overlap: float,
    share: float,
    closing: float,
    slip: float,
    spring: Any,
    implicit: Any,
) -> tuple[float, float]:
    """Return (N, T) in N by entry e of the law; both are 0 for an overlap (m) of 0 or less.

    share: effective overlap over geometric overlap, 1 for a single contact; N and T are scaled by it. closing: m/s,
    relative velocity (a minus b) along n. slip: m/s, relative velocity of the contact points along t. atan: selects the
    friction curve (`friction.py`). spring: m, elongation of the tangential spring, or None. implicit: None for explicit
    friction, else as in `contact_parts`.
    """
    normal, tangential, _ = contact_parts(
        law, e, curves, slip_limit, atan, overlap, share, closing, slip, spring, implicit
    )
    return normal, tangential


@part
def contact_parts(
    law: ContactLaw,
    e: int,
    curves: Any,
    slip_limit: float,
    atan: Any,
    overlap: float,
    share: float,
    closing: float,
    slip: float,
    spring: Any,
    implicit: Any,
) -> tuple[float, float, float]:
    """Return N and T as `contact_force`, and the part of T in N that is friction by the curve, all in N.

    implicit: None, or dt/m_t times `EngineSettings.ahead` in s/kg, `EngineSettings.at_once`, and the slip (m/s) minus
    the first one times the friction (N) from which the solver starts (`friction.py`).
    """
    depth = 0.0 if overlap < 0.0 else overlap
    elastic = elastic_force(law, e, curves, depth)
    damped = never_pull(law, add_damping(law, e, elastic, elastic, depth, closing))
    normal = share * add_drag(law, e, damped, elastic, depth, closing)
    # Coulomb's law needs a pressing contact; paper damping may pull at the end of a rebound.
    pressing = 0.0 if normal < 0.0 else normal
    sliding = _sliding(law, e, slip_limit, atan, pressing, slip, implicit)
    tangential = _tangential(law, e, depth, share, pressing, slip, spring, sliding)
    return normal, add_drag(law, e, tangential, elastic, depth, -slip * share), sliding


@part
def elastic_force(law: ContactLaw, e: int, curves: Any, depth: float) -> float:
    """Return the force of the elastic laws, N. depth: m, not negative."""
    return add_elastic_force(law, e, 0.0, depth, curves)


@part
def elastic_energy(law: ContactLaw, e: int, curves: Any, depth: float) -> float:
    """Return the energy stored by the elastic laws, J. depth: m, not negative."""
    return add_elastic_energy(law, e, 0.0, depth, curves)


@part
def drag_force(law: ContactLaw, e: int, elastic: float, depth: float, velocity: float) -> float:
    """Return the isotropic damping force along a velocity (m/s), N, at an elastic force (N)."""
    return add_drag(law, e, 0.0, elastic, depth, velocity)


@part
def _sliding(
    law: ContactLaw, e: int, slip_limit: float, atan: Any, pressing: float, slip: float, implicit: Any
) -> float:
    """Return Coulomb friction in N by its regularised curve."""
    if law.friction is None:
        return 0.0
    most = law.friction[e] * pressing
    return -most * _curve_share(most, slip, slip_limit, atan, implicit)


@part
def _tangential(
    law: ContactLaw, e: int, depth: float, share: float, pressing: float, slip: float, spring: Any, sliding: float
) -> float:
    """Return friction in N: by its curve or, if the pair has one, by its tangential spring."""
    if law.friction is None:
        return 0.0
    if spring is None:
        return sliding
    if law.tangential_stiffness is None:
        return sliding
    most = law.friction[e] * pressing
    stiff = _tangential_stiffness(law, e, depth)
    held = -share * _add_damping(stiff * spring, law.tangential_damping, e, slip)
    held = -most if -most > held else held
    held = most if held > most else held
    return held if stiff > 0.0 else sliding


@part
def _tangential_stiffness(law: ContactLaw, e: int, depth: float) -> float:
    """Return the tangential spring's stiffness at an overlap, N/m: constant, or 8 G* sqrt(R* delta) (Mindlin 1949)."""
    if law.tangential_stiffness is None:
        return 0.0
    if law.tangential_mindlin is None:
        return law.tangential_stiffness[e]
    return law.tangential_stiffness[e] + law.tangential_mindlin[e] * math.sqrt(depth)


@part
def _curve_share(most: float, slip: float, slip_limit: float, atan: Any, implicit: Any) -> float:
    if implicit is None:
        return friction_share(slip, slip_limit, atan)
    compliance, at_once, start = implicit
    b = most * compliance * (1.0 / slip_limit) - at_once
    return implicit_share(start, 0.0 if b < 0.0 else b, slip_limit, atan)


@part
def _add_damping(force: float, damping: Any, e: int, slip: float) -> float:
    if damping is None:
        return force
    return force + damping[e] * slip


@part
def spring_energy(law: ContactLaw, e: int, spring: Any, overlap: float) -> float:
    """Return the energy of a tangential spring with an elongation (m), or None, at an overlap (m), J."""
    if spring is None:
        return 0.0
    depth = 0.0 if overlap < 0.0 else overlap
    return 0.5 * _tangential_stiffness(law, e, depth) * spring * spring


@part
def carried(law: ContactLaw, e: int, spring: Any, overlap: float, deeper: float, further: float) -> Any:
    """Return the elongation (m) of a spring after its overlap (m) grew by `deeper` (m), or None without a spring.

    A spring that has become stiffer keeps its force, because the added contact area carries no tangential load yet. One
    that has become softer keeps its elongation (Thornton, Cummins and Cleary 2013). So a change of stiffness never adds
    energy. further: m, elongation added in the same step; its force is computed with the mean stiffness of the step.
    """
    if spring is None:
        return None
    return spring - _loss(law.tangential_mindlin, e, spring + 0.5 * further, 0.0 if overlap < 0.0 else overlap, deeper)


@part
def _loss(mindlin: Any, e: int, middle: float, depth: float, deeper: float) -> float:
    """Return the elongation (m) that a spring loses as it stiffens. middle: m, its mean elongation."""
    if mindlin is None:
        return 0.0
    before = depth - deeper
    before = 0.0 if before < 0.0 else before
    before = depth if before > depth else before
    share = 1.0 - math.sqrt(before / (depth if depth > 0.0 else 1.0))
    return (share if mindlin[e] > 0.0 else 0.0) * middle


@part
def stretched(spring: Any, slip: float, dt: float) -> Any:
    """Return the elongation (m) including the slip of this step, or None.

    Without that slip, springs would gain energy.
    """
    if spring is None:
        return None
    return spring + dt * slip


@part
def history_after(
    law: ContactLaw,
    e: int,
    spring: float,
    kept: float,
    overlap: float,
    slip: float,
    dt: float,
    spring_dt: float,
    normal: float,
    share: float,
    friction: float,
) -> float:
    """Return the elongation (m) of a spring after dt (s) of slip; for a contact without one, its friction (N).

    kept: the elongation before, which stays if spring_dt is 0. Other arguments as in `spring_after`.
    """
    if law.tangential_stiffness is None:
        return friction
    after = spring_after(law, e, spring, overlap, slip, dt, normal, share)
    after = after if spring_dt > 0.0 else kept
    has_spring = _tangential_stiffness(law, e, 1.0) > 0.0
    return after if has_spring else friction


@part
def spring_after(
    law: ContactLaw, e: int, spring: float, overlap: float, slip: float, dt: float, normal: float, share: float
) -> float:
    """Return the elongation (m) of the tangential spring after dt (s) of slip (m/s), with its force limited to mu N.

    overlap: m. normal: N, of the contact; 0, as without contact, resets the spring. The result is 0 for a pair without
    a spring (Cundall and Strack 1979).
    """
    if law.friction is None:
        return 0.0
    depth = 0.0 if overlap < 0.0 else overlap
    stiffness = _tangential_stiffness(law, e, depth)
    longer = spring + dt * slip
    most = law.friction[e] * (0.0 if normal < 0.0 else normal)
    # The spring force is scaled by `share`, as N is.
    scaled = share * stiffness
    cut = math.copysign(most, longer) / (scaled if scaled > 0.0 else 1.0)
    kept = cut if scaled * abs(longer) > most else longer
    return kept if stiffness > 0.0 else 0.0
