# SPDX-License-Identifier: Apache-2.0
"""Checks of contacts: laws that exclude each other, restitution without closed form, tables that fall."""

from collections.abc import Iterable, Iterator

from conveyor_sim.scene.contacts import DAMPING_CHOICES, ELASTIC, Base, Contact, Tangential
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.types import MOST
from conveyor_sim.scene.words import listed, shown

BASE_SPRINGS = ("leapfrog", "semi_implicit_euler", "velocity_verlet")
"""Integrators with springs under the bottles: one evaluation per step, at positions that bottles reach."""
STEPPED = ("leapfrog", "semi_implicit_euler", "velocity_verlet", "rk4")
"""Integrators with tangential springs and implicit friction: every step is accepted, and its length is known.

dormand_prince rejects steps and chooses others; linearly_implicit solves for all velocities at once.
"""


def contact_problems(scene: Scene) -> Iterator[Problem]:
    """Yield problems of contacts, of ring-shaped bases, and of the friction solver."""
    for index, contact in enumerate(scene.contacts):
        path: Path = ("contacts", index)
        yield from _elastic(path, contact)
        yield from _damping((*path, "damping"), contact)
        if contact.table is not None:
            yield from _table((*path, "table"), contact.table)
        if contact.tangential is not None and contact.friction == 0.0:
            yield Problem((*path, "tangential"), "given without friction, expected friction greater than 0 beside it")
        if contact.tangential is not None:
            yield from _tangential((*path, "tangential"), contact, contact.tangential)
        if contact.tangential is not None and scene.accuracy.integrator not in STEPPED:
            yield Problem((*path, "tangential"), f"given, expected none with integrator {scene.accuracy.integrator}")
    sprung = {base.between[0]: index for index, base in enumerate(scene.base) if base.tangential is not None}
    for index in sprung.values():
        yield from _base_spring(("base", index), scene.base[index], scene.accuracy.integrator)
    for name, kind in scene.bottle_types.items():
        if kind.base_radius is not None and kind.material in sprung:
            yield Problem(
                ("bottle_types", name, "base_radius"),
                f"{shown(kind.base_radius)} given, expected none beside base[{sprung[kind.material]}].tangential: its "
                "spring holds a bottle that stands on a point",
            )
        if kind.base_radius is not None and kind.base_radius > kind.radius:
            yield Problem(
                ("bottle_types", name, "base_radius"),
                f"{shown(kind.base_radius)} given, expected at most the radius, {kind.radius:g} (m)",
            )
    if scene.friction_solver == "implicit" and scene.accuracy.integrator not in (*STEPPED, "impulses"):
        yield Problem(
            ("friction_solver",), f'"implicit" given, expected "explicit" with integrator {scene.accuracy.integrator}'
        )


def _base_spring(path: Path, base: Base, integrator: str) -> Iterator[Problem]:
    if base.friction == 0.0:
        yield Problem((*path, "tangential"), "given without friction, expected friction greater than 0 beside it")
    if integrator not in BASE_SPRINGS:
        yield Problem(
            (*path, "tangential"),
            f"given, expected none with integrator {integrator}, or integrator {listed(list(BASE_SPRINGS))}",
        )


def _elastic(path: Path, contact: Contact) -> Iterator[Problem]:
    given = [field for field in ELASTIC if getattr(contact, field) is not None]
    if len(given) != 1:
        yield Problem(path, f"{' and '.join(given) or 'no stiffness'} given, expected one of {listed(list(ELASTIC))}")


def _damping(path: Path, contact: Contact) -> Iterator[Problem]:
    damping = contact.damping
    if damping.law == "none":
        for field in ("coefficient", "restitution", "speed"):
            value = getattr(damping, field)
            if value:
                yield Problem(
                    (*path, field),
                    f'{shown(value)} given, expected law {_quoted(DAMPING_CHOICES)} beside it (the law is "none")',
                )
        return
    elastic = next((field for field in ELASTIC if getattr(contact, field) is not None), "stiffness")
    choice = DAMPING_CHOICES[damping.law]
    if elastic not in choice.elastic:
        laws = [law for law, other in DAMPING_CHOICES.items() if elastic in other.elastic]
        yield Problem(
            (*path, "law"),
            f'"{damping.law}" given, expected {listed(list(choice.elastic))} beside it, or law {_quoted(laws)}: '
            f"with {elastic} it has no meaning",
        )
        return
    if damping.restitution is None:
        if damping.speed is not None:
            yield Problem((*path, "speed"), f"{shown(damping.speed)} given, expected it with restitution only")
        return
    if "coefficient" in damping.model_fields_set:
        yield Problem(path, "coefficient and restitution given, expected one of them")
    if elastic not in choice.restitution:
        laws = [law for law, other in DAMPING_CHOICES.items() if elastic in other.restitution]
        yield Problem(
            (*path, "restitution"),
            f"{shown(damping.restitution)} given, expected a coefficient, or law {_quoted(laws)}: "
            f'with {elastic} the restitution of law "{damping.law}" depends on speed',
        )
    elif choice.at_speed and damping.speed is None:
        yield Problem((*path, "speed"), "missing, expected the speed at which the restitution holds (m/s)")
    elif not choice.at_speed and damping.speed is not None:
        yield Problem(
            (*path, "speed"),
            f'{shown(damping.speed)} given, expected none: the restitution of law "{damping.law}" holds at any speed',
        )


def _quoted(laws: Iterable[str]) -> str:
    return listed([f'"{law}"' for law in laws])


def _tangential(path: Path, contact: Contact, spring: Tangential) -> Iterator[Problem]:
    given = [field for field in ("stiffness", "stiffness_ratio") if getattr(spring, field) is not None]
    if len(given) != 1:
        yield Problem(
            path, f"{' and '.join(given) or 'no stiffness'} given, expected one of stiffness and stiffness_ratio"
        )
    elif spring.stiffness_ratio is not None and contact.hertz_stiffness is None:
        yield Problem(
            (*path, "stiffness_ratio"),
            f"{shown(spring.stiffness_ratio)} given, expected stiffness: "
            "only with hertz_stiffness does the stiffness grow with the overlap",
        )


def _table(path: Path, points: tuple[tuple[float, float], ...]) -> Iterator[Problem]:
    before = (0.0, 0.0)
    for index, point in enumerate(points):
        if point == before and index == 0:
            continue
        if not all(abs(value) <= MOST for value in point) or point[0] <= before[0] or point[1] < before[1]:
            yield Problem(
                path,
                f"point {index + 1}, {shown(point)}, follows {shown(before)}: "
                "expected overlaps that grow from 0 and forces that do not fall (m, N)",
            )
            return
        before = point
    if before[1] == 0.0:
        yield Problem(path, "no force at any overlap given, expected one greater than 0 (N)")
