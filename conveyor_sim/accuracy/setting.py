# SPDX-License-Identifier: Apache-2.0
"""A setting: one way to simulate a scene, with contacts as stiff or softer, and the scene with it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from conveyor_sim.physics.laws.coefficients import damping_law, elastic_law
from conveyor_sim.scene import Scene, parse_again, parse_overrides
from conveyor_sim.scene.accuracy import explicit
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


@dataclass(frozen=True, order=True)
class Setting:
    """An integrator, its steps, and how much softer than the scene's the contacts are."""

    integrator: str
    per_tick: int
    """Steps in a tick; of a method that chooses its own, the first."""
    stiffness: float = 1.0
    """Factor on every stiffness, at constant restitution."""
    error: float | None = None
    """m/s, largest error of a step, of a method that chooses its own; None for all others."""
    sweeps: int | None = None
    """Sweeps in a step, of the method of impulses; None for all others."""

    def dt(self, scene: Scene) -> float:
        """Time step, s."""
        return scene.tick / self.per_tick

    @property
    def key(self) -> str:
        """A short text by which it differs from all other settings of a scene, for files."""
        parts = [self.integrator, str(self.per_tick)]
        parts += [f"k{self.stiffness:g}"] if self.stiffness != 1.0 else []
        parts += [f"e{self.error:g}"] if self.error is not None else []
        parts += [f"w{self.sweeps}"] if self.sweeps is not None else []
        return " ".join(parts)


def with_setting(scene: Scene, setting: Setting, **fields: Any) -> Scene:
    """Return the scene with a setting, and with other fields (as in a scene file) as overrides.

    Raise SceneError if the scene can't be simulated with them.
    """
    overrides: dict[str, Any] = dict(parse_overrides(scene.overrides_text))
    overrides = _merged(overrides, fields)
    overrides["accuracy"] = explicit(setting.integrator, setting.per_tick, setting.error, setting.sweeps)
    if setting.stiffness != 1.0:
        overrides["contacts"] = scaled_contacts(scene, setting.stiffness)
    return parse_again(scene.source_text, scene.source_name, overrides)


def _merged(data: Any, changes: Any) -> Any:
    if not (isinstance(data, Mapping) and isinstance(changes, Mapping)):
        return changes
    return {**data, **{key: _merged(data.get(key), change) for key, change in changes.items()}}
