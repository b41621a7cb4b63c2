# SPDX-License-Identifier: Apache-2.0
"""Input for bounds on the time step and for predicted errors, and functions that several effects use."""

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from conveyor_sim.engine.arrays.contacts import ContactLaw
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.contact.laws import DAMPING, ELASTIC, DampingLaw, ElasticLaw
from conveyor_sim.physics.effects.load import Load, contact_load
from conveyor_sim.physics.laws.coefficients import Laws
from conveyor_sim.physics.plant import Plant
from conveyor_sim.physics.timestep.bounds import Bound, least_steps
from conveyor_sim.physics.timestep.methods import IMPULSES, METHODS, STEP_ERROR, Method
from conveyor_sim.scene.schema import BottleType, Scene


@dataclass(frozen=True, eq=False)
class Terms:
    """A plant with its coefficients, the effects that are on, and the tolerance."""

    plant: Plant
    laws: Laws
    on: Collection[str]
    tolerance: float
    """Largest relative error in contact force."""

    @property
    def scene(self) -> Scene:
        """Scene of the plant."""
        return self.plant.scene

    @property
    def types(self) -> list[BottleType]:
        """Bottle types in the scene's order, (T,)."""
        return list(self.scene.bottle_types.values())

    @cached_property
    def load(self) -> Load:
        """Largest expected resting load on a contact."""
        return contact_load(self.plant, self.laws)

    @property
    def method(self) -> Method:
        """Error coefficients of the integrator."""
        return METHODS.get(self.scene.accuracy.integrator, IMPULSES)

    @property
    def step_error(self) -> float:
        """Largest error per step of an integrator that divides its steps itself, m/s."""
        error = self.scene.accuracy.error
        return STEP_ERROR if error is None else error

    @property
    def steps(self) -> float:
        """Smallest number of steps that resolves a time scale."""
        return least_steps(self.tolerance)


@dataclass(frozen=True)
class Meeting:
    """One entry of a ContactLaw: two bottle types, or a type and a rail material, and their coefficients."""

    what: str
    """`two bottles`, or `a bottle and a rail`."""
    law: ContactLaw
    entry: int
    reduced_mass: float
    """kg"""
    first: BottleType
    second: BottleType | None
    """None for a rail."""

    def value(self, column: F8 | None) -> float:
        """Return the coefficient of this meeting, 0 if it has none."""
        return 0.0 if column is None else float(column[self.entry])

    def coefficient(self, law: DampingLaw) -> float:
        """Return the coefficient of a damping law, 0 if the meeting has another law or none."""
        return self.value(getattr(self.law, law.column))

    @property
    def elastic(self) -> tuple[ElasticLaw, Any]:
        """Elastic law, with its coefficient or table number."""
        columns = ((law, getattr(self.law, law.column)) for law in ELASTIC)
        laws = ((law, column[self.entry].item()) for law, column in columns if column is not None)
        return next((law, k) for law, k in laws if k > law.none)

    @property
    def damping(self) -> DampingLaw | None:
        """Damping law; None without damping."""
        return next((law for law in DAMPING if self.coefficient(law)), None)

    @property
    def has_spring(self) -> bool:
        """True if a tangential spring replaces the friction curve."""
        return self.value(self.law.tangential_stiffness) + self.value(self.law.tangential_mindlin) > 0.0


def meetings(terms: Terms) -> Iterator[Meeting]:
    """Yield every pair of bottle types that can touch, then every bottle type and rail material.

    Types without bottles are left out.
    """
    types = terms.types
    present = [index for index, name in enumerate(terms.scene.bottle_types) if name in terms.plant.supply]
    if terms.laws.pair is not None:
        for a in present:
            for b in present:
                one, other = types[a], types[b]
                reduced = one.mass * other.mass / (one.mass + other.mass)
                yield Meeting("two bottles", terms.laws.pair, a * len(types) + b, reduced, one, other)
    if terms.laws.rail is not None:
        columns = [column for column in terms.laws.rail if column is not None]
        materials = columns[0].size // len(types) if columns else 0
        for a in present:
            one = types[a]
            for material in range(materials):
                entry = a * materials + material
                yield Meeting("a bottle and a rail", terms.laws.rail, entry, one.mass, one, None)


def tightest(name: str, candidates: Sequence[tuple[float, str]], stability: bool = False) -> list[Bound]:
    """Return the smallest of some bounds (s, reason) in a list; an empty list without bounds."""
    if not candidates:
        return []
    dt, reason = min(candidates)
    return [Bound(name, dt, reason, stability)]


def drag_bound(terms: Terms, dt: float, reason: str) -> tuple[float, str]:
    """Convert a bound (s) for a drag, valid for semi-implicit Euler, to the scene's integrator."""
    limit = terms.method.drag_limit
    return limit * dt, reason if limit == 1.0 else f"{limit:g} times {reason}"


def deepest(meeting: Meeting, terms: Terms, speed: float) -> tuple[float, float]:
    """Return overlap (m) and force (N) at the turning point of an undamped head-on impact at a speed in m/s."""
    law, k = meeting.elastic
    return law.deepest(k, 0.5 * meeting.reduced_mass * speed * speed, terms.laws.curves)


def overlap_at(meeting: Meeting, terms: Terms, force: float) -> float:
    """Return the overlap (m) at which the elastic law gives a force (N)."""
    law, k = meeting.elastic
    return law.overlap_at(k, force, terms.laws.curves)


def duration(meeting: Meeting, terms: Terms, speed: float) -> float:
    """Return the duration (s) of an undamped head-on impact at a speed in m/s; a lower bound for tables."""
    law, k = meeting.elastic
    return law.duration(k, meeting.reduced_mass, speed, terms.laws.curves)


def frequency(meeting: Meeting, terms: Terms, speed: float) -> float:
    """Return sqrt(-N'' / N) in rad/s at the force peak N of an undamped head-on impact at a speed in m/s."""
    law, k = meeting.elastic
    depth, _ = deepest(meeting, terms, speed)
    return math.sqrt(law.stiffest(k, depth, terms.laws.curves) / meeting.reduced_mass)
