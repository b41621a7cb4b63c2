"""Equivalent stiffness: the contacts of a scene made softer or harder at constant restitution."""

from __future__ import annotations

import math
from typing import Any

from conveyor_sim.physics.laws.damping import damping_law, elastic_law
from conveyor_sim.scene import Scene
from conveyor_sim.scene.contacts import Contact


def scaled_contacts(scene: Scene, factor: float) -> list[dict[str, Any]]:
    """Return the scene's contacts, as in a scene file, with every stiffness times `factor`.

    A linear contact of stiffness f k rebounds as before with a dashpot of sqrt(f) c, of the same c / (2 sqrt(k m)).
    A Hertz contact, f^(2/5) times as short at any speed, needs f^(2/5) c; each damping law declares its power. A
    specified restitution stays. The paper's outlook: a lower equivalent stiffness.
    """
    return [_scaled(contact, factor) for contact in scene.contacts]


def _scaled(contact: Contact, factor: float) -> dict[str, Any]:
    data: dict[str, Any] = contact.model_dump(exclude_none=True)
    data["between"] = list(contact.between)
    for field in ("stiffness", "hertz_stiffness"):
        if field in data:
            data[field] *= factor
    if contact.table is not None:
        data["table"] = [[overlap, force * factor] for overlap, force in contact.table]
    if contact.damping.restitution is None and (law := damping_law(contact)) is not None:
        data["damping"]["coefficient"] *= factor ** law.stiffness_power(elastic_law(contact).name)
    if contact.tangential is not None:
        if contact.tangential.stiffness is not None:
            data["tangential"]["stiffness"] *= factor
        data["tangential"]["damping"] *= math.sqrt(factor)
    return data
