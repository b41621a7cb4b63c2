# SPDX-License-Identifier: Apache-2.0
"""Errors against the number of steps in the closed forms that a scene's laws have, and the orders they show."""

from collections.abc import Callable, Sequence

import numpy as np

from conveyor_sim.accuracy.cases.aside import PHASES
from conveyor_sim.accuracy.cases.collision import collision_of, rail_materials, terms_of
from conveyor_sim.accuracy.cases.head_on import HeadOn, restitution_of, slip_for_sliding
from conveyor_sim.accuracy.cases.set_down import SetDown
from conveyor_sim.accuracy.results import Order
from conveyor_sim.physics.effects.terms import Meeting, Terms, meetings
from conveyor_sim.scene import Scene

SMOOTH_ORDERS = {
    "leapfrog": 1,
    "semi_implicit_euler": 1,
    "velocity_verlet": 2,
    "rk4": 4,
    "dormand_prince": 5,
    "linearly_implicit": 2,
}
"""Order through smooth forces that depend on velocities."""

ROUNDING = 1e-11
"""Relative error below which rounding shows in positions of some metres."""

FITTED = 4
"""Number of finest errors from which the observed order is fitted."""

Case = HeadOn | SetDown
Progress = Callable[[float, float], None]
"""Called with what is done so far and the whole."""


def orders(scene: Scene, integrators: Sequence[str], progress: Progress) -> tuple[list[Order], dict[str, str]]:
    """Errors of integrators in the cases of a scene; and cases that have no closed form, with the reason.

    dormand_prince takes equal steps here. Progress in simulations.
    """
    cases, skipped = cases_of(scene)
    whole = sum(len(case.steps) for case in cases) * len(integrators)
    done = 0
    found = []
    for case in cases:
        for integrator in integrators:
            errors: dict[str, list[float]] = {}
            for steps in case.steps:
                progress(done, whole)
                done += 1
                for quantity, error in case.errors(case.run(integrator, steps)).items():
                    errors.setdefault(quantity, []).append(error)
            for quantity, row in errors.items():
                found.append(_order(case, quantity, integrator, row))
    progress(whole, whole)
    return found, skipped


def cases_of(scene: Scene) -> tuple[list[Case], dict[str, str]]:
    """Return the cases with a closed form, and those without, with the reason."""
    terms = terms_of(scene)
    speed = terms.plant.impact_speed
    cases: list[Case] = []
    skipped: dict[str, str] = {}
    for meeting in _meetings(terms, sliding=False):
        collision = collision_of(meeting, terms)
        e = restitution_of(collision, speed)
        if isinstance(e, str):
            skipped[f"head on, {collision.name}"] = e
        else:
            cases.append(HeadOn(collision, speed, e, *_partners(meeting, scene)))
    turns = "rotation" in terms.on
    for meeting in _meetings(terms, sliding=True):
        collision = collision_of(meeting, terms)
        e = restitution_of(collision, speed)
        if scene.friction_curve == "atan":
            skipped[f"sliding impact, {collision.name}"] = "with friction_curve atan friction is never full"
        elif meeting.has_spring:
            skipped[f"sliding impact, {collision.name}"] = "a tangential spring is slack at first touch"
        elif isinstance(e, str):
            skipped[f"sliding impact, {collision.name}"] = e
        else:
            slip = slip_for_sliding(collision, speed, e, turns)
            cases.append(HeadOn(collision, speed, e, *_partners(meeting, scene), slip))
    cases += _set_downs(terms, skipped)
    return cases, skipped


def _meetings(terms: Terms, sliding: bool) -> list[Meeting]:
    """One of each elastic law and damping; two bottles if there are such, but a bottle and a rail for sliding.

    The normal of two bottles that slide along each other turns, that of a straight rail does not.
    """
    found: dict[str, Meeting] = {}
    for meeting in meetings(terms):
        if sliding and (meeting.second is not None or meeting.value(meeting.law.friction) == 0.0):
            continue
        collision = collision_of(meeting, terms)
        found.setdefault(collision.name, meeting)
    return list(found.values())


def _partners(meeting: Meeting, scene: Scene) -> tuple[tuple[str, ...], str]:
    """Bottle types that meet, and the material of the rail, empty without one."""
    names = list(scene.bottle_types)
    if meeting.second is not None:
        first, second = divmod(meeting.entry, len(names))
        return (names[first], names[second]), ""
    materials = rail_materials(scene)
    kind, material = divmod(meeting.entry, len(materials))
    return (names[kind],), materials[material]


def _set_downs(terms: Terms, skipped: dict[str, str]) -> list[SetDown]:
    """For the first type on a point and the first on a ring, of those with friction under them."""
    table, scene = terms.laws.base_friction, terms.scene
    found: dict[bool, SetDown] = {}
    for index, (name, kind) in enumerate(scene.bottle_types.items()):
        mu = 0.0 if table is None else float(table[:, index].max())
        ring = kind.base_radius is not None and "ring_base" in terms.on
        if mu > 0.0 and ring not in found:
            found[ring] = SetDown(scene, name, mu, ring)
    if False in found and scene.friction_curve == "atan":
        skipped[found.pop(False).name] = "with friction_curve atan the slip has no closed form"
    return list(found.values())


def _order(case: Case, quantity: str, integrator: str, errors: list[float]) -> Order:
    steps = np.array(case.steps, dtype=np.float64)
    clear = np.flatnonzero(np.array(errors) > ROUNDING)[-FITTED:]
    slope = np.polyfit(np.log(steps[clear]), np.log(np.array(errors)[clear]), 1)[0] if clear.size > 1 else np.nan
    return Order(
        case=case.name,
        quantity=quantity,
        integrator=integrator,
        steps=case.steps,
        errors=tuple(errors),
        phases=PHASES,
        observed=float(-slope),
        expected=case.expected(SMOOTH_ORDERS[integrator]) if clear.size == FITTED else None,
    )
