# SPDX-License-Identifier: Apache-2.0
"""Scenes as they are drawn, checked as a scene file is, without writing and reading them as text."""

from __future__ import annotations

from typing import Any

from pydantic import ValidationError

from conveyor_sim.scene import Scene
from conveyor_sim.scene.checks import problems_of


def checked(data: dict[str, Any]) -> Scene | None:
    """The scene with no effect forced; None where it would be refused."""
    try:
        scene = Scene.model_validate({**data, "effects": {}})
    except ValidationError:
        return None
    return None if problems_of(scene) else scene
