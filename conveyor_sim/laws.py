"""The tables of contact and friction constants by bottle type, from the scene's pairs of materials."""

from collections.abc import Callable, Sequence

import numpy as np

from conveyor_sim.engine.arrays import F8, PairLaw, RailLaw
from conveyor_sim.scene.schema import Contact, Floor, Scene


def pair_law(scene: Scene) -> PairLaw:
    """Constants of contact between bottle types, (T, T)."""
    materials = [kind.material for kind in scene.bottle_types.values()]
    return PairLaw(*_contact_tables(scene, materials, materials))


def rail_law(scene: Scene, rail_materials: Sequence[str]) -> RailLaw:
    """Constants of contact between bottle types and rail materials, (T, M)."""
    materials = [kind.material for kind in scene.bottle_types.values()]
    return RailLaw(*_contact_tables(scene, materials, rail_materials))


def base_friction(scene: Scene) -> F8:
    """Coefficient of friction of each belt and, last, the floor on each bottle type, (H + 1, T)."""
    given = {base.between: base.friction for base in scene.base}
    types = list(scene.bottle_types.values())
    table = np.zeros((len(scene.belts) + 1, len(types)))
    for row, belt in enumerate(scene.belts.values()):
        table[row] = [given[kind.material, belt.material] for kind in types]
    if isinstance(scene.floor, Floor):
        if scene.floor.friction is not None:
            table[-1] = scene.floor.friction
        elif scene.belts:
            table[-1] = table[0]
    return table


def _contact_tables(
    scene: Scene, rows: Sequence[str], columns: Sequence[str]
) -> tuple[F8, F8 | None, F8 | None, F8 | None]:
    """Stiffness, friction, paper damping, normal damping; None where all are 0. Pairs that never meet get 0."""
    given = {frozenset(contact.between): contact for contact in scene.contacts}

    def table(value: Callable[[Contact], float]) -> F8:
        found = [[given.get(frozenset((a, b))) for b in columns] for a in rows]
        return np.array([[value(contact) if contact else 0.0 for contact in row] for row in found])

    def damping(law: str) -> F8 | None:
        return _or_none(table(lambda contact: contact.damping.coefficient if contact.damping.law == law else 0.0))

    return (
        table(lambda contact: contact.stiffness),
        _or_none(table(lambda contact: contact.friction)),
        damping("paper"),
        damping("normal"),
    )


def _or_none(table: F8) -> F8 | None:
    return table if table.any() else None
