# SPDX-License-Identifier: Apache-2.0
"""One impact of a bottle on another or on a rail: the closed forms of its rebound, and how long it lasts.

Along the normal it is one body of the reduced mass m_r that runs onto the contact at a speed v: m_r x'' = -N(x, x').
"""

import math
import sys
from dataclasses import dataclass
from typing import Any

from conveyor_sim.engine.contact.laws import DampingLaw, ElasticLaw
from conveyor_sim.engine.contact.laws.linear import LINEAR
from conveyor_sim.physics.effects.choice import choose_effects
from conveyor_sim.physics.effects.terms import Meeting, Terms, deepest
from conveyor_sim.physics.laws.coefficients import build_laws
from conveyor_sim.physics.plant import Plant
from conveyor_sim.physics.timestep.presets import DEFAULT, PRESETS
from conveyor_sim.scene import Scene, rail_shapes

SAMPLES = 2000
"""Steps of an undamped contact's order of duration by which an impact is integrated: its duration to 1e-3 of one."""

LONGEST = 40 * SAMPLES
"""Steps after which a contact is taken not to end: damped beyond a rebound."""


@dataclass(frozen=True)
class Collision:
    """Contact laws of two materials in a head-on collision."""

    elastic: ElasticLaw
    stiffness: Any
    """Its coefficient, or the number of its table."""
    damping: DampingLaw | None
    meeting: Meeting
    terms: Terms

    @property
    def name(self) -> str:
        """In words, such as `linear, clamped dashpot`."""
        return f"{self.elastic.words}, {'undamped' if self.damping is None else self.damping.words}"

    @property
    def coefficient(self) -> float:
        """Return the damping coefficient, 0 without damping."""
        return 0.0 if self.damping is None else self.meeting.coefficient(self.damping)


def terms_of(scene: Scene) -> Terms:
    """Return the coefficients and enabled effects of a scene."""
    plant = Plant.of(scene)
    on = frozenset(choice.name for choice in choose_effects(plant) if choice.on)
    return Terms(plant, build_laws(scene, rail_materials(scene), on), on, PRESETS[DEFAULT])


def rail_materials(scene: Scene) -> list[str]:
    """In the order of the entries of the rails' law."""
    return sorted({rail.material for rail in rail_shapes(scene)})


def collision_of(meeting: Meeting, terms: Terms) -> Collision:
    """Return the laws that act between two bodies."""
    elastic, stiffness = meeting.elastic
    return Collision(elastic, stiffness, meeting.damping, meeting, terms)


def damping_ratio(collision: Collision, speed: float) -> float:
    """Return zeta = c / (2 sqrt(k m_r)) of a linear spring, or of the equivalent one at a speed (m/s).

    Return 0 for a law without damping.
    """
    damping = collision.damping
    if damping is None or damping.ratio is None:
        return 0.0
    return damping.ratio(collision.stiffness, collision.coefficient, collision.meeting.reduced_mass, speed)


def rebound(collision: Collision, speed: float) -> float | str:
    """Speed after over speed before, by closed form; or why there is none."""
    if collision.damping is None:
        return 1.0
    m_r, c = collision.meeting.reduced_mass, collision.coefficient
    found = collision.damping.rebound(collision.elastic.name, collision.stiffness, c, m_r, speed)
    return f"{collision.name}: its rebound has no closed form" if found is None else found


def peak_force(collision: Collision, speed: float) -> float | None:
    """Largest force (N) of a linear contact: v sqrt(k m_r) exp(-zeta (3 acos zeta - pi) / sqrt(1 - zeta^2)).

    None where the dashpot's jump at first touch is larger (zeta > 1/2), and for other laws.
    """
    damping = collision.damping
    if collision.elastic is not LINEAR or (damping is not None and (damping.exponent > 0.0 or damping.ratio is None)):
        return None
    zeta = damping_ratio(collision, speed)
    if zeta > 0.5:
        return None
    meeting = collision.meeting
    undamped = speed * math.sqrt(collision.stiffness * meeting.reduced_mass)
    return undamped * math.exp(-zeta * (3.0 * math.acos(zeta) - math.pi) / math.sqrt(1.0 - zeta * zeta))


def duration(collision: Collision, speed: float) -> float:
    """Time (s) from first touch until the force has gone; inf if it never does.

    By integration, damping included: most laws have no formula.
    """
    overlap, _ = deepest(collision.meeting, collision.terms, speed)
    if overlap == 0.0:
        return math.inf
    force, m = _Force(collision), collision.meeting.reduced_mass
    dt = math.pi * overlap / speed / SAMPLES
    x, v, left = 0.0, speed, math.inf
    for step in range(LONGEST):
        a1 = -force(x, v) / m
        v2 = v + 0.5 * dt * a1
        a2 = -force(x + 0.5 * dt * v, v2) / m
        v3 = v + 0.5 * dt * a2
        a3 = -force(x + 0.5 * dt * v2, v3) / m
        v4 = v + dt * a3
        a4 = -force(x + dt * v3, v4) / m
        x += dt * (v + 2.0 * v2 + 2.0 * v3 + v4) / 6.0
        v += dt * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0
        before, left = left, force(x, v) if force.clamped else x
        if v < 0.0 and left <= 0.0:
            return (step + before / (before - left)) * dt
    return math.inf


class _Force:
    """N(x, x') of an impact, in N."""

    def __init__(self, collision: Collision) -> None:
        self._collision = collision
        self._curves = collision.terms.laws.curves
        self._coefficient = collision.coefficient
        jumps = collision.damping is not None and collision.damping.exponent == 0.0
        # Where such a law sets in, its force is there.
        self._least = sys.float_info.min if jumps else 0.0
        self.clamped = collision.damping is not None and not collision.damping.isotropic

    def __call__(self, x: float, v: float) -> float:
        """Return the force during contact. The caller ends the contact, with a clamped dashpot where this is 0."""
        collision, depth = self._collision, max(x, self._least)
        elastic = collision.elastic.force(collision.stiffness, depth, self._curves)
        if collision.damping is None:
            return elastic
        return elastic + collision.damping.force(self._coefficient, elastic, depth, v)
