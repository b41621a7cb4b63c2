# SPDX-License-Identifier: Apache-2.0
"""Numbers of a plan as a person would write them."""

from __future__ import annotations

import math

from conveyor_sim.scene.types import XY


def number(value: float) -> float | int:
    """Return a length (m) rounded to 1e-9 m."""
    rounded = round(value, 9) + 0.0
    return int(rounded) if rounded == int(rounded) else rounded


def point(at: XY) -> list[float | int]:
    """Return a point (m) rounded to 1e-9 m."""
    return [number(value) for value in at]


def degrees(angle: float) -> str:
    """Return an angle (rad) as a text in degrees, rounded to 1e-10 deg."""
    rounded = round(math.degrees(angle), 10) + 0.0
    return f"{int(rounded)} deg" if rounded == int(rounded) else f"{rounded!r} deg"
