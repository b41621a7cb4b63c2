# SPDX-License-Identifier: Apache-2.0
"""Scenes around a layout, as text and from Python."""

from __future__ import annotations

import json
from typing import Any

from conveyor_sim.scene import Scene, parse_scene

HEAD = """\
name: layout
duration: 10
contacts: [{between: [glass, glass], stiffness: 20000}, {between: [glass, steel], stiffness: 20000}]
base: [{between: [glass, chain], friction: 0.2}, {between: [glass, nylon], friction: 0.2}]
bottle_types: {jar: {radius: 0.03, mass: 0.3, material: glass}}
"""


def read(text: str = "", **fields: Any) -> Scene:
    """A scene with a layout, as text after HEAD, or as fields."""
    more = "".join(f"{name}: {json.dumps(value)}\n" for name, value in fields.items())
    return parse_scene(HEAD + text + more, "plant.yaml")
