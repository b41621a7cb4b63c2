# SPDX-License-Identifier: Apache-2.0
"""Effects of damping in contacts: one per law in `engine/contact/laws/`, built from the declaration of the law."""

from collections.abc import Callable, Collection
from typing import Any

from conveyor_sim.engine.contact.laws import DAMPING, DampingLaw
from conveyor_sim.physics.effects.contacts import contacts_in_use
from conveyor_sim.physics.effects.declaration import Cause, Effect
from conveyor_sim.physics.effects.terms import Meeting, Terms, deepest, drag_bound, frequency, meetings, tightest
from conveyor_sim.physics.laws.coefficients import damping_law
from conveyor_sim.physics.plant import Plant
from conveyor_sim.physics.timestep.bounds import Bound, damping_bound
from conveyor_sim.physics.timestep.methods import Share


def _called_for(law: DampingLaw) -> Callable[[Plant, Collection[str]], Cause | None]:
    def called_for(plant: Plant, on: Collection[str]) -> Cause | None:
        for index, contact in contacts_in_use(plant, on):
            if damping_law(contact) is law:
                damping = contact.damping
                if damping.restitution is None:
                    return Cause(("contacts", index, "damping"), f"{damping.coefficient:g} {law.unit}")
                return Cause(("contacts", index, "damping", "restitution"), f"{damping.restitution:g}")
        return None

    return called_for


def _dashpot(law: DampingLaw, meeting: Meeting, terms: Terms) -> float:
    """Return the force per speed (kg/s) at the largest overlap of an impact; 0 if the meeting has another law."""
    coefficient = meeting.coefficient(law)
    if coefficient == 0.0:
        return 0.0
    depth, elastic = deepest(meeting, terms, terms.plant.impact_speed)
    return law.force(coefficient, elastic, depth, 1.0)


def _bounds(law: DampingLaw) -> Callable[[Terms], list[Bound]]:
    def bounds(terms: Terms) -> list[Bound]:
        if not terms.method.explicit:
            return []
        candidates = []
        for meeting in meetings(terms):
            c = _dashpot(law, meeting, terms)
            if c > 0.0:
                said = f"m_r / (2 {law.rate}) at c = {c:g} kg/s"
                if law.exponent > 0.0:
                    speed = terms.plant.impact_speed
                    said = f"m_r / (2 {law.rate}), {c:.3g} kg/s at the largest overlap of an impact at {speed:g} m/s"
                candidates.append(drag_bound(terms, damping_bound(c, meeting.reduced_mass), said))
        return tightest(law.label, candidates, stability=True)

    return bounds


def _shares(law: DampingLaw) -> Callable[[Meeting, Terms], list[Share]]:
    def shares(meeting: Meeting, terms: Terms) -> list[Share]:
        c, method = _dashpot(law, meeting, terms), terms.method
        if c == 0.0:
            return []
        rate = c / meeting.reduced_mass
        if law.exponent > 0.0:
            return [method.growing(law.exponent, rate, frequency(meeting, terms, terms.plant.impact_speed))]
        # The decay after the jump is known only for a linear spring.
        return method.first_touch(rate, meeting.value(meeting.law.stiffness) / c)

    return shares


def _share(law: DampingLaw) -> str:
    if law.exponent == 0.0:
        return (
            f"{law.rate} dt / m_r, or k dt / c if that is less, because the jump of the force at first touch acts up "
            "to a step late"
        )
    power = "w dt" if law.exponent == 1.0 else f"(w dt)^{law.exponent:g}"
    return f"{law.rate} dt / m_r; with methods of second order, {power} times that"


def _effect(law: DampingLaw) -> Effect:
    name: Any = law.effect
    return Effect(
        name=name,
        law=law.law,
        source=law.source,
        called_for=_called_for(law),
        absent=law.absent,
        needs=law.needs,
        bounds=_bounds(law),
        bound=", ".join(text for text in (f"m_r / (2 {law.rate})", law.rate_at) if text),
        shares=_shares(law),
        share=_share(law),
    )


DAMPING_EFFECTS: tuple[Effect, ...] = tuple(_effect(law) for law in DAMPING)
TURNING = tuple(effect for effect, law in zip(DAMPING_EFFECTS, DAMPING, strict=True) if law.isotropic)
"""Damping effects that also act along the tangent."""
