# SPDX-License-Identifier: Apache-2.0
"""Effects of friction: in contacts, its curve, how it is solved, and the spring with history."""

import math
from collections.abc import Collection
from functools import partial

from conveyor_sim.engine.contact.laws.linear import contact_time
from conveyor_sim.engine.integrators import AHEAD, SWEPT, WARM
from conveyor_sim.physics.effects.contacts import contacts_in_use
from conveyor_sim.physics.effects.declaration import Cause, Effect
from conveyor_sim.physics.effects.load import ENDLESS_QUEUE
from conveyor_sim.physics.effects.terms import (
    Meeting,
    Terms,
    deepest,
    drag_bound,
    frequency,
    meetings,
    overlap_at,
    tightest,
)
from conveyor_sim.physics.plant import Plant
from conveyor_sim.physics.timestep.bounds import Bound, contact_friction_bound, damping_bound
from conveyor_sim.physics.timestep.prediction import Term
from conveyor_sim.scene.schema import BottleType

CLOSED = 4.0
"""Closed contacts of a bottle in a zigzag: two bottles, a rail and the base. Implicit friction splits its mass."""

BALANCING = 8.0
"""1/s; times n dt of a queue of n bottles the root of the error of its creep, at most. Fitted to the first 19 scenes of
docs/studies/implicit_queues.py, at `draft`."""

CHANGE = 0.1
"""Largest relative change of resting forces in 1 s while a queue creeps; 0.06 in docs/studies/implicit_queues.csv."""


def _contact_friction(plant: Plant, on: Collection[str]) -> Cause | None:
    for index, contact in contacts_in_use(plant, on):
        if contact.friction > 0.0:
            return Cause(("contacts", index, "friction"), f"{contact.friction:g}")
    return None


def _contact_friction_bounds(terms: Terms) -> list[Bound]:
    """Return the stability bound of explicit friction at the largest load of belts on a contact."""
    load = terms.load
    if load.force == 0.0 or "implicit_friction" in terms.on or not terms.method.explicit:
        return []
    candidates = []
    for meeting in meetings(terms):
        mu, kind = _curve_friction(meeting), meeting.first
        if mu > 0.0:
            dt = contact_friction_bound(
                mu, load.force, kind.mass, kind.moment_of_inertia, kind.radius, terms.scene.slip_limit
            )
            at = f"at mu = {mu:g} and N = {load.force:.3g} N, {load.reason}"
            candidates.append(drag_bound(terms, dt, f"v_lim / [2 mu (1/m + R^2/J) N] {at}"))
    return tightest("contact friction", candidates, stability=True)


def _kick(terms: Terms, dt: float) -> list[Term]:
    """Return the slip that remains after an impact, relative to the impact speed, if dt is too long for friction.

    If mu (w dt)^2 is small compared with v_lim / v, friction stops the slip before the impact ends.
    """
    if "implicit_friction" in terms.on or terms.method.slip == 0.0:
        return []
    speed = terms.plant.impact_speed
    kicks = []
    for meeting in meetings(terms):
        mu = _curve_friction(meeting)
        w = frequency(meeting, terms, speed)
        # Steps per contact for stable explicit friction at the peak of the impact. Two equal hoops: 2 pi mu v / v_lim.
        mobility = _rim_mobility(meeting.first) + _rim_mobility(meeting.second)
        resolved = math.pi * mu * meeting.reduced_mass * mobility * speed / terms.scene.slip_limit
        steps = math.pi / (w * dt)
        if mu > 0.0 and steps < resolved:
            kick = 0.5 * terms.method.slip * mu * (w * dt) * (w * dt)
            reason = (
                f"{steps:.3g} steps per impact of {meeting.what} at {speed:g} m/s; friction needs {resolved:.3g}, "
                "pi mu (m_r / m_t) v / v_lim"
            )
            kicks.append((kick, reason))
    return [Term("tangential speed after an impact", *max(kicks))] if kicks else []


def _excess(terms: Terms, dt: float) -> tuple[float, str]:
    """Return the excess of the creep of loaded contacts over that of explicit friction, relative to it, and its cause.

    With a warm start, n bottles in a row balance a change of load in about n steps: the error is of second order in
    n dt. Without one, the slip at a load f mu N is too large by B f v_lim, for small f by the share 2 B (`friction.py`
    in the engine), here at the largest load on a contact.
    """
    integrator, load = terms.scene.accuracy.integrator, terms.load
    if load.force == 0.0 or all(_curve_friction(meeting) == 0.0 for meeting in meetings(terms)):
        return 0.0, ""
    if _is_warm(terms):
        most = terms.plant.most_bottles
        count = ENDLESS_QUEUE if most is None else most
        return (
            BALANCING * count * dt
        ) ** 2, f"{count} bottles in a row balance a change of load in about {count} steps"
    ahead, at_once = AHEAD[integrator]
    cases = [(0.0, "")]
    for meeting in meetings(terms):
        mu = _curve_friction(meeting)
        b = dt * _rate(meeting, mu, terms)
        reason = f"{integrator} solves friction anew in each step, at mu = {mu:g} and N = {load.force:.3g} N"
        cases.append((2.0 * max(0.0, ahead * b - at_once), reason))
    return max(cases)


def _is_warm(terms: Terms) -> bool:
    """Return True if implicit friction starts from that of the last step."""
    return terms.scene.accuracy.integrator in WARM and not terms.scene.friction_anew


def _rate(meeting: Meeting, mu: float, terms: Terms) -> float:
    """Return b / dt (1/s) at the largest load on a contact and CLOSED contacts (`friction.py` in the engine)."""
    mobility = CLOSED * (_rim_mobility(meeting.first) + _rim_mobility(meeting.second))
    return mu * terms.load.force * mobility / terms.scene.slip_limit


def _implicit_bounds(terms: Terms) -> list[Bound]:
    """Return the longest time step of friction that is solved anew with an error in resting load of the tolerance."""
    if _is_warm(terms):
        return []
    ahead, at_once = AHEAD[terms.scene.accuracy.integrator]
    most = (at_once + terms.tolerance / CHANGE) / ahead
    candidates = []
    for meeting in meetings(terms):
        if (rate := _rate(meeting, mu := _curve_friction(meeting), terms)) > 0.0:
            reason = f"{most:.2g} m_t v_lim / (mu N) at mu = {mu:g}, N = {terms.load.force:.3g} N, {CLOSED:g} contacts"
            candidates.append((most / rate, reason))
    return tightest("creep of pressed contacts", candidates)


def _implicit_resting(terms: Terms, dt: float) -> list[Term]:
    """Return the error in resting load if contacts creep at another rate: forces change faster or slower by that share.

    Forces change by less than CHANGE in 1 s, by half of it in the mean.
    """
    excess, reason = _excess(terms, dt)
    return [Term("load of creeping queues", min(1.0, 0.5 * CHANGE * excess), reason)] if excess > 0.0 else []


def _implicit_creep(terms: Terms, dt: float) -> list[Term]:
    excess, reason = _excess(terms, dt)
    return [Term("creep of pressed contacts", excess, reason)] if excess > 0.0 else []


def _curve_friction(meeting: Meeting) -> float:
    """Return mu of a contact with a friction curve, 0 for a tangential spring."""
    return 0.0 if meeting.has_spring else meeting.value(meeting.law.friction)


def _chosen(plant: Plant, on: Collection[str], *, field: str, value: str) -> Cause | None:
    if getattr(plant.scene, field) == value and ("contact_friction" in on or "base_friction" in on):
        return Cause((field,), value)
    return None


def _implicit(plant: Plant, on: Collection[str]) -> Cause | None:
    # Impulses have implicit friction with either solver.
    if plant.scene.accuracy.integrator in SWEPT:
        return None
    return _chosen(plant, on, field="friction_solver", value="implicit")


def _spring(plant: Plant, on: Collection[str]) -> Cause | None:
    if "contact_friction" not in on:
        return None
    for index, contact in contacts_in_use(plant, on):
        if contact.tangential is not None:
            stiffness, ratio = contact.tangential.stiffness, contact.tangential.stiffness_ratio
            said = f"{stiffness:g} N/m" if stiffness is not None else f"{ratio:g} of the normal stiffness"
            return Cause(("contacts", index, "tangential"), said)
    return None


def _rim_mobility(kind: BottleType | None) -> float:
    """Return the tangential mobility of the rim, 1/m + R^2/J, in 1/kg; 0 for a rail."""
    return 0.0 if kind is None else 1.0 / kind.mass + kind.radius**2 / kind.moment_of_inertia


def _largest_stiffness(meeting: Meeting, terms: Terms) -> float:
    """Return the stiffness of the tangential spring, N/m; Mindlin's at the largest overlap in impacts and queues."""
    if (mindlin := meeting.value(meeting.law.tangential_mindlin)) > 0.0:
        pressed = overlap_at(meeting, terms, terms.load.force)
        return mindlin * math.sqrt(max(deepest(meeting, terms, terms.plant.impact_speed)[0], pressed))
    return meeting.value(meeting.law.tangential_stiffness)


def _spring_bounds(terms: Terms) -> list[Bound]:
    springs, dashpots = [], []
    for meeting in meetings(terms):
        k, c = _largest_stiffness(meeting, terms), meeting.value(meeting.law.tangential_damping)
        mass = 1.0 / (_rim_mobility(meeting.first) + _rim_mobility(meeting.second))
        if k > 0.0:
            reason = f"{terms.steps:.3g} steps in pi sqrt(m_t / k_t) of {meeting.what} at k_t = {k:g} N/m"
            springs.append((contact_time(k, mass) / terms.steps, reason))
        if c > 0.0:
            dashpots.append(drag_bound(terms, damping_bound(c, mass), f"m_t / (2 c_t) at c_t = {c:g} kg/s"))
    return [*tightest("tangential spring", springs), *tightest("tangential damping", dashpots, stability=True)]


CONTACT_FRICTION = Effect(
    name="contact_friction",
    law="mu N p(s), at the rim",
    source="(7)-(10)",
    called_for=_contact_friction,
    absent="no contact with friction",
    needs="mu by pair of materials",
    bounds=_contact_friction_bounds,
    bound="v_lim / [2 mu (1/m + R^2/J) N]. N is the load on a contact from belts full of bottles, or from all bottles "
    "of the scene if that is less (physics/effects/load.py)",
    side=_kick,
    beside="in the tangential speed after an impact mu (w dt)^2 / 2 times the speed of impact, if a contact lasts for "
    "fewer than pi mu (m_r / m_t) v / v_lim steps. 1 / m_t is the sum of 1/m + R^2/J of the bottles that touch. For "
    "two equal hoops the number is 2 pi mu v / v_lim",
)
ATAN_FRICTION = Effect(
    name="atan_friction",
    law="p(s) = 2/pi atan(pi s / v_lim), in contacts and under bottles that stand on points",
    source="named in the paper",
    called_for=partial(_chosen, field="friction_curve", value="atan"),
    absent="friction_curve is polynomial, or nothing has friction",
    needs="only v_lim",
    can_force_on=True,
)
IMPLICIT_FRICTION = Effect(
    name="implicit_friction",
    law="friction at the slip at the end of a step, with the mass of a bottle split among its contacts. With leapfrog, "
    "semi_implicit_euler and velocity_verlet each step starts from the friction forces of the last one. Steady creep "
    "then equals that of explicit friction in steps of any length (docs/studies/implicit_queues.csv). n bottles in a "
    "row balance a change of load in about n steps. With rk4 friction is solved "
    "anew in each step. Up to gamma dt = 1 it equals explicit friction; gamma is 2 mu N / (m_t v_lim) times the number "
    "of closed contacts. In longer steps a loaded contact creeps too fast, by gamma dt - 1 of its creep, and the "
    "prediction says so. Not available with dormand_prince, which divides its steps, and linearly_implicit, which "
    "solves for friction itself",
    source="added; the warm start as in Catto, GDC 2006",
    called_for=_implicit,
    absent="friction_solver is explicit, nothing has friction, or the friction of integrator impulses is implicit",
    needs="closed contacts and 1/m + R^2/J of each bottle",
    bounds=_implicit_bounds,
    bound="with rk4 gamma dt is at most 1 + 20 times the tolerance, for resting load; none with the others. It removes "
    "the bounds of contact_friction and, for bases that are points, of base_friction",
    resting=_implicit_resting,
    rest="5 % of the error of the creep, because forces change by less than 10 % in 1 s",
    side=_implicit_creep,
    beside="in the creep of pressed contacts at most (8 n dt)^2 for n bottles, dt in s; with rk4 gamma dt - 1 at the "
    "largest expected load and 4 closed contacts",
)
TANGENTIAL_SPRING = Effect(
    name="tangential_spring",
    law="a spring along the contact, elongated by the slip, with a force of at most mu N. With stiffness_ratio its "
    "stiffness is that ratio times dN/d delta of a Hertz contact. The spring keeps its force when the stiffness grows, "
    "and its elongation when it falls. At moving rails the slip is relative to the rail. Available with leapfrog, "
    "semi-implicit Euler, velocity Verlet (order 2) and rk4 (order 4 while sticking, 2 at the onset of sliding), which "
    "limit the force once per step. Not available with dormand_prince, which rejects steps, and linearly_implicit, "
    "which solves for all velocities at once. At straight rails along a belt, springs carry a part of a queue, "
    "where Karim and Corwin (2014) measured that walls carry nothing: loads on bottles come out too small there, which "
    "is unsafe for crushing",
    source="Cundall and Strack 1979; Mindlin 1949, Thornton, Cummins and Cleary 2013",
    called_for=_spring,
    absent="no contact with tangential, or no friction in contacts",
    needs="elongation of each contact, kept through rebuilds; k_t, c_t and mu by pair of materials",
    bounds=_spring_bounds,
    bound="pi sqrt(m_t / k_t) divided by 2 / sqrt(tolerance), that is by 20 at 1 %, with k_t at the largest overlap in "
    "impacts and queues; and m_t / (2 c_t). 1 / m_t is the sum of 1/m + R^2/J of the bottles that touch",
)
