# SPDX-License-Identifier: Apache-2.0
"""Notes on the setup of a scene for readers of its results."""

from collections.abc import Collection

from conveyor_sim.physics.effects.contacts import contacts_in_use
from conveyor_sim.physics.plant import Plant

CAN = 0.73
"""Base radius of a beverage can divided by its radius; the base fits into the end of the can below (docs/base.md)."""

LEAST, MOST = 0.65, 1.8
"""Extreme ratios of rail scuffing by bottles on rings of CAN to that on points (docs/studies/base_radius.csv)."""


def notes(plant: Plant, on: Collection[str]) -> list[str]:
    """Return a list with one sentence if bottles on points may rub along rails, else an empty list."""
    on_points = bottles_on_points(plant, on)
    if not on_points:
        return []
    name = on_points[0]
    others = "" if len(on_points) == 1 else f", and {len(on_points) - 1} more,"
    return [
        f"bottle_types.{name}{others} stands on a point: nothing brakes its spin, and it rolls along rails; with rings "
        f"as bases, scuffing was {LEAST:g} to {MOST:g} times as large in shipped scenes (docs/base.md); give "
        f"base_radius, for a can {CAN:g} times the radius: {CAN * plant.scene.bottle_types[name].radius:.3g} m"
    ]


def bottles_on_points(plant: Plant, on: Collection[str]) -> list[str]:
    """Return the types of bottles on points that may rub along rails.

    Only the rail turns these bottles, so they roll along it (docs/base.md).
    """
    if not {"base_friction", "contact_friction", "rotation"} <= set(on) or "static_friction" in on:
        return []
    rub = [set(contact.between) for _, contact in contacts_in_use(plant, on) if contact.friction > 0.0]
    return [
        name
        for name, kind in plant.scene.bottle_types.items()
        if kind.base_radius is None and any({kind.material, rail} in rub for rail in plant.rail_materials)
    ]
