# SPDX-License-Identifier: Apache-2.0
"""A line with a device of each kind along a conveyor."""

from __future__ import annotations

from typing import Any

from scenes import base, contact, kind, scene

from conveyor_sim.scene.layout.expand import Expansion, expand
from conveyor_sim.scene.schema import Scene

Data = dict[str, Any]
LENGTH = 3.0 + 0.5 * 3.141592653589793 * 0.5
"""Length of the conveyor `lane` (m)."""
CLEARANCE = 0.08
RADIUS = 0.033
MOVES: Data = {"max_speed": 1.0, "acceleration": 5.0, "material": "steel"}
GUIDES: Data = {"clearance": CLEARANCE, "material": "steel"}


def lane(turn: str = "left", **fields: Any) -> Data:
    """A conveyor of 1 m, a bend of 90 degrees with a radius of 0.5 m, and 2 m, with guides."""
    path = [{"straight": 1.0}, {turn: "90 deg", "radius": 0.5}, {"straight": 2.0}]
    return {"start": [0.0, 0.0], "heading": 0.0, "path": path, "width": 0.1, "material": "chain", "speed": 0.4,
            "guides": GUIDES, **fields}  # fmt: skip


def devices(side: str = "left") -> Data:
    """A device of each kind along the conveyor `lane`. side: of those that have one."""
    along: Data = {"along": "lane"}
    sign = 1.0 if side == "left" else -1.0
    return {
        "rails": {
            "across": {**along, "at": "end", "material": "steel"},
            "beside": {**along, "from": 0.8, "to": 2.2, "offset": sign * 0.2, "material": "steel"},
        },
        "gates": {
            "slide": {"kind": "slide", **along, "at": 2.9, "side": side, "open": True, **MOVES},
            "lift": {"kind": "lift", **along, "at": 2.0, "open": True, **MOVES},
            "swing": {"kind": "swing", **along, "at": 1.5, "side": side, "angle": "80 deg", "open": True, **MOVES},
        },
        "pushers": {"pusher": {**along, "at": 2.6, "length": 0.12, "side": side, "stroke": 0.05, **MOVES}},
        "diverters": {"diverter": {**along, "at": 0.5, "length": 0.2, "side": side, "angle": "20 deg", **MOVES}},
        "dividers": {
            "arm": {"kind": "swing", **along, "at": 0.65, "length": 0.1, "offset": sign * 0.002, **MOVES,
                    "positions": [sign * -0.1, sign * 0.1], "lane": 1},
            "shuttle": {"kind": "slide", **along, "from": 2.6, "to": 2.8, **MOVES,
                        "positions": [sign * 0.3, sign * 0.35]},
        },
        "adjustable": {"guide": {**along, "from": 2.2, "to": 2.4, "side": side, "positions": [0.05, 0.055], **MOVES}},
        "clamps": {"clamp": {**along, "from": 2.9, "to": 3.0, "stroke": 0.005, **MOVES}},
        "infeeds": {"feed": {"bottle": "bottle", **along, "at": 0.1, "offset": sign * 0.001, "rate": 2.0, "count": 3}},
        "outfeeds": {"out": {**along, "at": "end", "length": 0.1}},
        "machines": {
            "source": {"kind": "source", "bottle": "bottle", **along, "at": 0.3, "rate": 1.0},
            "sink": {"kind": "sink", **along, "from": 2.0, "to": 2.2, "rate": 1.0},
            "station": {"kind": "station", **along, "at": 1.3, "length": 0.1, "rate": 1.0,
                        "out": {**along, "at": 1.45}},
            "camera": {"kind": "inspection", **along, "at": 0.8},
            "reject": {"kind": "reject", **along, "from": 1.6, "to": 1.9, "offset": sign * 0.01, "width": 0.05},
        },
        "spills": {"spill": {"bottle": "bottle", **along, "at": 1.2, "offset": -sign * 0.002}},
        "photo_eyes": {"eye": {**along, "at": 0.6}, "longer": {**along, "at": 1.4, "extend": 0.01}},
        "zones": {"zone": {**along, "from": 0.5, "to": 2.5}},
        "counters": {"counter": {**along, "at": 1.1}},
        "bottles": [
            {"type": "bottle", **along, "at": 0.9, "offset": sign * 0.003},
            {"grid": {"type": "bottle", **along, "at": 2.3, "rows": 1, "columns": 2, "pitch": 0.07}},
        ],
    }  # fmt: skip


def line(layout: Data | None = None, **fields: Any) -> Data:
    """Fields of a scene with the conveyor `lane`."""
    laws: Data = {"damping": ("normal", 0.4), "friction": 0.1}
    return {
        "bottle_types": {"bottle": kind(RADIUS, 0.35)},
        "contacts": [contact(5e4, **laws), contact(5e4, "steel", **laws)],
        "base": base(0.3),
        "conveyors": {"lane": lane(), **(layout or {})},
        **fields,
    }


def placed(layout: Data | None = None, **fields: Any) -> Scene:
    """The scene of a line."""
    return scene(**line(layout, **fields))


def expansion(layout: Data | None = None, **fields: Any) -> Expansion:
    """The expansion of a line without problems."""
    result = expand(line(layout, **fields))
    assert result.problems == []
    return result
