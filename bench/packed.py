# SPDX-License-Identifier: Apache-2.0
"""The dense table: N bottles pressed against the end wall of a box by the belt that runs on below, as scenes.

The box is 2 : 1 and at most 8 m long; beyond that it only gets wider. Bottles, friction and stiffness are the paper's.
The bottles begin in a hexagonal packing at the end wall, its rows across the belt.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any

from conveyor_sim.scene import Scene, parse_scene

RADIUS, MASS = 0.065, 0.2
"""m, kg"""
STIFFNESS, WALL_STIFFNESS = 5e3, 10e3
"""N/m, bottle on bottle and bottle on wall."""
SPEED, FRICTION, GRAVITY, SLIP_LIMIT = 0.2, 0.4, 9.81, 0.01
"""m/s, 1, m/s^2, m/s: belt, its friction, and v_lim."""
DT, TICK = 40e-6, 0.01
"""s"""
PITCH = 2.0 * RADIUS * (1.0 + 1e-6)
"""m, of bottles that just don't touch."""
LONGEST = 8.0
"""m, of a box."""
FILL = 0.95
"""So much of the box's length is taken at the start."""
DURATION = 1e4
"""s, more than anything here runs."""

NO_OUTPUTS = dict.fromkeys(Scene.TOPICS, 0)
EFFECTS = ("minimal", "paper", "everything")


@dataclass(frozen=True)
class Box:
    """Walls at x = 0 and `length`, y = 0 and `width` (m); `rows` of at most `across` bottles."""

    length: float
    width: float
    rows: int
    across: int
    count: int

    def row(self, i: int) -> tuple[float, float, int]:
        """Axis of the first bottle of row i from the end wall, m, and how many the row has."""
        x = self.length - 0.5 * PITCH - i * PITCH * math.sqrt(0.75)
        return x, 0.5 * PITCH * (1 + i % 2), min(self.across, self.count - i * self.across)


def box_for(count: int) -> Box:
    """Return the box for `count` bottles."""
    row = PITCH * math.sqrt(0.75)
    across = max(2, round(math.sqrt(count * row / (FILL * 2.0 * PITCH))))
    if math.ceil(count / across) * row / FILL > LONGEST:
        across = math.ceil(count / math.floor(FILL * LONGEST / row))
    rows = math.ceil(count / across)
    return Box(min(LONGEST, rows * row / FILL + PITCH), (across + 0.5) * PITCH, rows, across, count)


def table(count: int, effects: str, dt: float = DT, /, **changes: Any) -> Scene:
    """Build the dense table with one of EFFECTS, in steps of dt (s). changes: fields of the scene to override."""
    box = box_for(count)
    fields: dict[str, Any] = {
        "name": f"table_{effects}",
        "duration": DURATION,
        "tick": TICK,
        "accuracy": {"per_tick": round(TICK / dt)},
        "gravity": GRAVITY,
        "slip_limit": SLIP_LIMIT,
        "bottle_types": {"soft": {"radius": RADIUS, "mass": MASS, "material": "bottle"}},
        "base": [{"between": ["bottle", "belt"], "friction": FRICTION}],
        "belts": {
            "table": {"kind": "straight", "start": [0, 0], "angle": 0, "length": box.length, "width": box.width,
                      "speed": SPEED, "material": "belt"},
        },
        "rails": {
            "walls": {"kind": "polyline", "closed": True, "material": "rail",
                      "points": [[0, 0], [box.length, 0], [box.length, box.width], [0, box.width]]},
        },
        "outputs": NO_OUTPUTS,
    }  # fmt: skip
    fields |= {"minimal": _minimal, "paper": _paper, "everything": _everything}[effects](box)
    return parse_scene(json.dumps({**fields, **changes}))


def _minimal(box: Box) -> dict[str, Any]:
    """Springs, walls, and the belt under each bottle as a point."""
    return {"contacts": _contacts(), "bottles": _rows(box, "soft")}


def _paper(box: Box) -> dict[str, Any]:
    """Return the paper's damping, and friction at contacts, which turns bottles."""
    laws = {"damping": {"law": "paper", "coefficient": 0.1}, "friction": 0.1}
    return {"contacts": _contacts(**laws), "bottles": _rows(box, "soft")}


def _everything(box: Box) -> dict[str, Any]:
    """Two kinds of bottles; linear and Hertz contacts, four laws of damping, tangential springs, ring bases, peaks; and
    beside the table a line with infeed, curved belt, arc rails and outfeed."""
    spring = {"tangential": {"stiffness": 2e3, "damping": 0.1}, "friction": 0.1}
    # At 5 mm of overlap as stiff as the linear contacts.
    hertz = {"hertz_stiffness": STIFFNESS / math.sqrt(0.005), "damping": {"law": "normal", "restitution": 0.9}}
    normal = {"law": "normal", "coefficient": 0.1}
    onset = {"law": "onset", "restitution": 0.9, "speed": 0.2}
    y = box.width + 1.0
    lane = {"inner": True, "outer": True, "material": "rail"}
    return {
        "bottle_types": {
            "soft": {"radius": RADIUS, "mass": MASS, "material": "bottle", "base_radius": 0.045},
            "slim": {"radius": 0.9 * RADIUS, "mass": 0.8 * MASS, "material": "pet", "base_radius": 0.04},
        },
        "contacts": [
            {"between": ["bottle", "bottle"], **hertz, **spring},
            {"between": ["bottle", "pet"], "stiffness": STIFFNESS, "damping": normal, **spring},
            {"between": ["pet", "pet"], "stiffness": STIFFNESS, "damping": onset, **spring},
            {"between": ["bottle", "rail"], "stiffness": WALL_STIFFNESS, "damping": normal, **spring},
            {"between": ["pet", "rail"], "stiffness": WALL_STIFFNESS, "damping": {"law": "paper", "coefficient": 0.1},
             "friction": 0.1},
        ],
        "base": [{"between": [material, "belt"], "friction": FRICTION} for material in ("bottle", "pet")],
        "belts": {
            "table": {"kind": "straight", "start": [0, 0], "angle": 0, "length": box.length, "width": box.width,
                      "speed": SPEED, "material": "belt"},
            "bend": {"kind": "curved", "centre": [0, y + 0.5], "inner_radius": 0.4, "width": 0.2, "speed": SPEED,
                     "start_angle": "180 deg", "span": "180 deg", "material": "belt", "rails": lane},
        },
        "infeeds": {"filler": {"bottle": "slim", "position": [-0.5, y + 0.45], "direction": "-90 deg", "speed": SPEED,
                               "rate": 0.5}},
        "outfeeds": {"packer": {"region": [[0.3, y + 0.3], [0.7, y + 0.3], [0.7, y + 0.5], [0.3, y + 0.5]]}},
        "bottles": [
            entry
            for start in (0, 1)
            for entry in _rows(box, ("soft", "slim")[start], start, 2)
        ],
        "outputs": {**NO_OUTPUTS, "bottles": 50},
    }  # fmt: skip


def _contacts(**laws: Any) -> list[dict[str, Any]]:
    return [
        {"between": ["bottle", "bottle"], "stiffness": STIFFNESS, **laws},
        {"between": ["bottle", "rail"], "stiffness": WALL_STIFFNESS, **laws},
    ]


def _rows(box: Box, kind: str, start: int = 0, step: int = 1) -> list[dict[str, Any]]:
    """Every step-th bottle of every row, from the one at `start`; rows shift it by one."""
    entries = []
    for i in range(box.rows):
        x, y, count = box.row(i)
        first = (start + i) % step
        if count > first:
            origin, rows = [x, y + first * PITCH], len(range(first, count, step))
            grid = {"type": kind, "origin": origin, "rows": rows, "columns": 1, "pitch": step * PITCH}
            entries.append({"grid": grid})
    return entries
