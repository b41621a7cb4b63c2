# SPDX-License-Identifier: Apache-2.0
"""Columns of contact and friction coefficients by bottle type, from the scene's pairs of materials."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from conveyor_sim.engine.arrays.contacts import ContactLaw, Curves
from conveyor_sim.engine.arrays.types import F8, I4
from conveyor_sim.engine.contact.laws import DAMPING, ELASTIC, DampingLaw, ElasticLaw
from conveyor_sim.engine.contact.laws.table import TABLE
from conveyor_sim.scene.contacts import Contact
from conveyor_sim.scene.geometry import surface_materials
from conveyor_sim.scene.schema import Floor, Scene

DAMPING_BY_NAME: Mapping[str, DampingLaw] = {law.name: law for law in DAMPING}


def elastic_law(contact: Contact) -> ElasticLaw:
    """Return the elastic law whose field the scene sets."""
    return next(law for law in ELASTIC if getattr(contact, law.field) is not None)


def damping_law(contact: Contact) -> DampingLaw | None:
    """Return the damping law; None if none is chosen, the coefficient is 0, or the restitution is 1."""
    damping = contact.damping
    if damping.restitution == 1.0 or (damping.restitution is None and damping.coefficient == 0.0):
        return None
    elastic, by_restitution = elastic_law(contact).name, damping.restitution is not None
    chosen = (law for law in DAMPING if law.chosen_as == damping.law and law.applies(elastic, by_restitution))
    return next(chosen, None)


def damping_coefficient(contact: Contact, law: DampingLaw, reduced_mass: float) -> float:
    """Return the coefficient in the unit of its law: as given, or from the restitution. reduced_mass: kg."""
    damping = contact.damping
    if damping.restitution is None:
        return damping.coefficient
    value = getattr(contact, elastic_law(contact).field)
    stiffness = 0.0 if isinstance(value, tuple) else value
    return law.coefficient(damping.restitution, damping.speed or 1.0, stiffness, reduced_mass)


NO_CURVE = int(TABLE.none)


class BaseSprings(NamedTuple):
    """Springs between surfaces and bases, (H + 1, T) each, the floor last; 0 where a friction curve acts."""

    stiffness: F8
    """N/m"""
    damping: F8
    """kg/s"""
    friction: F8


@dataclass(frozen=True, eq=False)
class Laws:
    """Coefficients of the laws that the scene enables. T bottle types, M rail materials, H surfaces."""

    pair: ContactLaw | None
    """(T * T,), bottle and bottle; None if bottles do not touch bottles."""
    rail: ContactLaw | None
    """(T * M,), bottle and rail; None without rails."""
    curves: Curves | None
    """Tables of force against overlap; None without tables."""
    base_friction: F8 | None
    """(H + 1, T), the floor last, 0 where a spring acts; None without friction curves under the bottles."""
    base_spring: BaseSprings | None
    """None without springs under the bottles."""
    base_radius: F8 | None
    """(T,), m, of the ring that a type stands on, 0 for a point; None if all stand on points."""

    @property
    def friction_under_bottles(self) -> F8 | None:
        """Friction coefficients under bottles, by curve or spring, (H + 1, T), the floor last; None without."""
        if self.base_spring is None or self.base_friction is None:
            return self.base_friction if self.base_spring is None else self.base_spring.friction
        return np.maximum(self.base_friction, self.base_spring.friction)

    @property
    def largest_base_friction(self) -> float:
        """Largest friction coefficient under any bottle; 0 without friction."""
        return 0.0 if (table := self.friction_under_bottles) is None else float(table.max())


def build_laws(scene: Scene, rail_materials: Sequence[str], on: Collection[str]) -> Laws:
    """Build the columns for the effects in `on`."""
    materials = [kind.material for kind in scene.bottle_types.values()]
    masses = np.array([kind.mass for kind in scene.bottle_types.values()])
    reduced = masses[:, None] * masses / (masses[:, None] + masses)
    against_rails = np.repeat(masses[:, None], len(rail_materials), axis=1)
    springs = base_springs(scene) if "static_friction" in on else None
    rails = any(effect in on for effect in ("segment_rails", "arc_rails", "moving_rails"))
    return Laws(
        pair=_columns(scene, materials, materials, reduced, on) if "bottle_contact" in on else None,
        rail=_columns(scene, materials, rail_materials, against_rails, on) if rails else None,
        curves=_curves(scene) if TABLE.name in on else None,
        base_friction=_by_curve(base_friction(scene), springs) if "base_friction" in on else None,
        base_spring=springs,
        base_radius=base_radius(scene) if "ring_base" in on else None,
    )


def base_friction(scene: Scene) -> F8:
    """Return the friction coefficients of surfaces and bottle types, (H + 1, T), the floor last."""
    friction = {base.between: base.friction for base in scene.base}
    types = list(scene.bottle_types.values())
    materials = surface_materials(scene)
    table = np.zeros((len(materials) + 1, len(types)))
    for row, material in enumerate(materials):
        table[row] = [friction[kind.material, material] for kind in types]
    if isinstance(scene.floor, Floor):
        if scene.floor.friction is not None:
            table[-1] = scene.floor.friction
        elif scene.belts:
            table[-1] = table[0]
    return table


def base_springs(scene: Scene) -> BaseSprings | None:
    """Return the springs under the bottles; None if no surface has one."""
    tangential = {base.between: base.tangential for base in scene.base}
    types = list(scene.bottle_types.values())
    friction = base_friction(scene)
    stiffness, damping = np.zeros((2, *friction.shape))
    for row, material in enumerate(surface_materials(scene)):
        for column, kind in enumerate(types):
            spring = tangential[kind.material, material]
            if spring is not None:
                stiffness[row, column], damping[row, column] = spring.stiffness, spring.damping
    if isinstance(scene.floor, Floor) and scene.floor.friction is None and scene.belts:
        stiffness[-1], damping[-1] = stiffness[0], damping[0]
    if not stiffness.any():
        return None
    return BaseSprings(stiffness, damping, np.where(stiffness > 0.0, friction, 0.0))


def _by_curve(friction: F8, springs: BaseSprings | None) -> F8 | None:
    """Return the friction coefficients without springs; None if springs act on all surfaces."""
    if springs is None:
        return friction
    rest = np.where(springs.stiffness > 0.0, 0.0, friction)
    return rest if rest.any() else None


def base_radius(scene: Scene) -> F8:
    """Return the radius of the ring that each bottle type stands on, (T,), m; 0 for a point."""
    return np.array([kind.base_radius or 0.0 for kind in scene.bottle_types.values()])


def _mindlin(contact: Contact) -> float:
    """Return Mindlin's tangential coefficient, N/m^1.5: stiffness_ratio times dN/d delta / sqrt(delta), 1.5 k_h."""
    if contact.tangential is None or contact.tangential.stiffness_ratio is None:
        return 0.0
    return contact.tangential.stiffness_ratio * 1.5 * (contact.hertz_stiffness or 0.0)


def _columns(
    scene: Scene, rows: Sequence[str], columns: Sequence[str], reduced_mass: F8, on: Collection[str]
) -> ContactLaw:
    """Return flat columns over materials in rows and columns, 0 without contact. reduced_mass: kg, (rows, columns)."""
    numbers = {frozenset(contact.between): index for index, contact in enumerate(scene.contacts)}
    contacts = [numbers.get(frozenset((a, b)), -1) for a in rows for b in columns]
    curve_of = {index: curve for curve, index in enumerate(_with_table(scene))}

    def column(effect: str, value: Callable[[Contact, float], float | None]) -> F8 | None:
        if effect not in on:
            return None
        entries = [
            (value(scene.contacts[index], mass) or 0.0) if index >= 0 else 0.0
            for index, mass in zip(contacts, reduced_mass.ravel().tolist(), strict=True)
        ]
        return np.array(entries) if any(entries) else None

    def damping(law: DampingLaw) -> F8 | None:
        return column(
            law.effect,
            lambda contact, mass: damping_coefficient(contact, law, mass) if damping_law(contact) is law else 0.0,
        )

    def stiffness(law: ElasticLaw) -> F8 | None:
        return column(law.name, lambda contact, _: getattr(contact, law.field))

    laws = {law.column: stiffness(law) for law in ELASTIC if law is not TABLE}
    laws |= {law.column: damping(law) for law in DAMPING}
    curve = _curve_column([curve_of.get(index, NO_CURVE) for index in contacts]) if TABLE.name in on else None
    mindlin = column("tangential_spring", lambda contact, _: _mindlin(contact))
    springs = column(
        "tangential_spring", lambda contact, _: contact.tangential.stiffness if contact.tangential else 0.0
    )
    return ContactLaw(
        **laws,
        **{TABLE.column: curve},
        friction=column("contact_friction", lambda contact, _: contact.friction),
        tangential_stiffness=np.zeros(len(contacts)) if springs is None and mindlin is not None else springs,
        tangential_mindlin=mindlin,
        tangential_damping=column(
            "tangential_spring", lambda contact, _: contact.tangential.damping if contact.tangential else 0.0
        ),
    )


def _with_table(scene: Scene) -> list[int]:
    return [index for index, contact in enumerate(scene.contacts) if contact.table is not None]


def _curve_column(curves: Sequence[int]) -> I4 | None:
    return np.array(curves, dtype=np.int32) if any(curve != NO_CURVE for curve in curves) else None


def _curves(scene: Scene) -> Curves:
    tables = [scene.contacts[index].table or () for index in _with_table(scene)]
    whole = [points if points[0] == (0.0, 0.0) else ((0.0, 0.0), *points) for points in tables]
    points = np.array([point for points in whole for point in points])
    return Curves(
        start=np.cumsum([0, *(len(points) for points in whole)]).astype(np.uint32),
        overlap=points[:, 0].copy(),
        force=points[:, 1].copy(),
    )
