# SPDX-License-Identifier: Apache-2.0
"""Scenes from Python: a test writes what it is about, the rest is left out. SI units."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.scene import Scene, parse_scene
from conveyor_sim.simulation import Simulation

ROOT = Path(__file__).parent.parent
SHIPPED = sorted(
    [
        *ROOT.glob("config/*.yaml"),
        *ROOT.glob("config/scenarios/*.yaml"),
        *ROOT.glob("examples/*.yaml"),
        *ROOT.glob("docs/**/scene.yaml"),
        ROOT / "test" / "testing" / "table.yaml",  # that of docs/testing_control_logic.md
    ]
)
"""Every scene file that is shipped or shown."""

DRIVEN_LINE = ROOT / "test" / "driven_line.yaml"
"""Scene with a named drive, m1, of the belts `feeder` (ratio 2) and `table`."""

RADIUS = 0.065
MASS = 0.2
NO_FLOOR: dict[str, Any] = {"floor": "none"}
PEAKS: dict[str, Any] = {"effects": {"peaks": "on"}}
COMMON: dict[str, Any] = dict.fromkeys(["peaks", "rotation", "unequal_radii", "energy_ledger"], "on")
"""Effects of all hard cases; see `with_bends`."""
SHARED_KERNELS: dict[str, Any] = {
    **dict.fromkeys(("buffer_lane", "reject_line", "watched_eyes"), PEAKS),
    "turntable": {"effects": COMMON},
}
"""Overrides of shipped scenes that change no bit, with which they share compiled kernels."""
NO_OUTPUTS = dict.fromkeys(Scene.TOPICS, 0)


def shipped_name(path: Path) -> str:
    """The name of one of `SHIPPED`, for a test."""
    return path.parent.name if path.stem == "scene" else path.stem


def scene(**fields: Any) -> Scene:
    """A scene with one bottle type, `bottle` of `glass` (the paper's radius and mass), and no outputs.

    Without the output of bottles there are no peaks; with PEAKS they add up from the start. The duration is a thousand
    ticks, which binds nobody here.
    """
    duration = 1000 * fields.get("tick", 0.01)
    defaults = {"name": "test", "duration": duration, "bottle_types": {"bottle": kind()}, "outputs": NO_OUTPUTS}
    return parse_scene(json.dumps({**defaults, **fields}))


def simulation(**fields: Any) -> Simulation:
    """The scene of these fields, ready to run."""
    return Simulation(scene(**fields))


def kind(radius: float = RADIUS, mass: float = MASS, material: str = "glass", **more: Any) -> dict[str, Any]:
    """A bottle type."""
    return {"radius": radius, "mass": mass, "material": material, **more}


def bottle(x: float, y: float, vx: float = 0.0, vy: float = 0.0, **more: Any) -> dict[str, Any]:
    """A bottle that is there at the start."""
    return {"type": "bottle", "position": [x, y], "velocity": [vx, vy], **more}


def contact(
    stiffness: float | None,
    other: str = "glass",
    damping: tuple[str, float] | None = None,
    friction: float = 0.0,
    **more: Any,
) -> dict[str, Any]:
    """Contact of glass with glass or another material; stiffness None where `more` gives another elastic law."""
    law, coefficient = damping or ("none", 0.0)
    elastic = {} if stiffness is None else {"stiffness": stiffness}
    return {
        "between": ["glass", other],
        "damping": {"law": law, "coefficient": coefficient},
        "friction": friction,
        **elastic,
        **more,
    }


def every_law(
    contacts: list[dict[str, Any]], bottle_types: dict[str, Any] | None = None, **fields: Any
) -> dict[str, Any]:
    """Fields of a scene with contacts of glass, and with every law of a contact of two bottles, and what goes with it.

    Three types without bottles have the laws; no bit of another bottle changes (test/physics/effects/test_absent.py).
    Tests of one law each share their compiled kernels so: it takes 10 s of a core for a set of effects.
    """
    hertz, table = {"hertz_stiffness": 1e5}, {"table": [[1e-3, 1.0], [2e-3, 4.0]]}
    normal, onset = {"law": "normal", "restitution": 0.5}, {"law": "onset", "restitution": 0.5, "speed": 1.0}
    laws = [
        ("glass", "odd", {"stiffness": 1e3, "damping": {"law": "paper", "coefficient": 1.0}, "friction": 0.1}),
        ("glass", "rare", {**hertz, "damping": normal}),
        ("odd", "odd", table),
        ("odd", "rare", {"stiffness": 1e3, "damping": normal}),
        ("rare", "rare", {"stiffness": 1e3, "damping": onset}),
        ("glass", "scarce", {**hertz, "damping": {"law": "viscoelastic", "restitution": 0.5, "speed": 1.0}}),
        *((other, "scarce", {"stiffness": 1e3}) for other in ("odd", "rare", "scarce")),
    ]
    return {
        **fields,
        "contacts": [*contacts, *({"between": [a, b], **law} for a, b, law in laws)],
        "bottle_types": {
            **(bottle_types or {"bottle": kind()}), "odd": kind(material="odd"), "rare": kind(material="rare"),
            "scarce": kind(material="scarce"),
        },
        "effects": {"peaks": "on", "rotation": "on", "unequal_radii": "on"},
    }  # fmt: skip


def with_bends(fields: dict[str, Any]) -> dict[str, Any]:
    """Fields of a scene, and out of everybody's way an arc of steel and a curved belt of chain that stands.

    A scene with straight rails and belts, friction and normal damping has the compiled kernels of the hard cases so, if
    its effects are COMMON: tests that must have many effects, or may, share them. A step takes some seconds to compile.
    """
    bend = {"kind": "curved", "centre": [9.0, 9.0], "inner_radius": 0.1, "width": 0.1, "start_angle": 0.0, "span": 1.0,
            "material": "chain", "speed": 0.0}  # fmt: skip
    return {
        **fields,
        "belts": {**fields["belts"], "spare": bend},
        "rails": {**fields["rails"], "spare": arc((9.0, 8.0), 0.1, 0.0, 1.0)},
    }


_SPRUNG: dict[str, Any] = {
    "damping": ("normal", 1.0), "friction": 0.2, "tangential": {"stiffness": 2000.0, "damping": 0.5},
}  # fmt: skip
_HEIGHTS = {"contact_height": 0.1, "gravity_height": 0.08}
SPRINGS_AND_RINGS: dict[str, Any] = {
    "bottle_types": {
        "bottle": kind(base_radius=0.04, **_HEIGHTS), "slim": kind(0.06, 0.15, base_radius=0.03, **_HEIGHTS),
    },
    "contacts": [contact(5000.0, **_SPRUNG), contact(8000.0, "steel", **_SPRUNG)],
    "gates": {
        "spare": {"kind": "slide", "from": [9.0, 7.0], "to": [9.0, 7.2], "direction": "90 deg", "stroke": 0.1,
                  "max_speed": 1.0, "acceleration": 10.0, "material": "steel"},
    },
    "outputs": {**NO_OUTPUTS, "damage": 100},
}  # fmt: skip
"""Fields of a scene with COMMON and bends, with what else can be: springs, rings, damage, a gate out of the way.

Tests of many effects share the kernels: with all of them a step takes longest to compile.
"""


def segment(start: tuple[float, float], end: tuple[float, float]) -> dict[str, Any]:
    """A straight rail of steel."""
    return {"kind": "segment", "from": start, "to": end, "material": "steel"}


def polyline(points: Any, closed: bool = False) -> dict[str, Any]:
    """A polyline of steel."""
    return {"kind": "polyline", "points": [list(map(float, p)) for p in points], "closed": closed, "material": "steel"}


def arc(centre: tuple[float, float], radius: float, start_angle: float, span: float) -> dict[str, Any]:
    """An arc rail of steel."""
    return {"kind": "arc", "centre": centre, "radius": radius, "start_angle": start_angle, "span": span,
            "material": "steel"}  # fmt: skip


def belt(
    speed: float, start: tuple[float, float] = (-5.0, -5.0), length: float = 10.0, width: float = 10.0, **more: Any
) -> dict[str, Any]:
    """A straight belt of chain along x, large enough that little leaves it."""
    more = {"angle": 0.0, "speed_limits": [-10.0, 10.0], **more}
    return {"kind": "straight", "start": start, "length": length, "width": width, "material": "chain", "speed": speed,
            **more}  # fmt: skip


def base(friction: float) -> list[dict[str, Any]]:
    """Friction of glass on chain."""
    return [{"between": ["glass", "chain"], "friction": friction}]


def stiffness_for(contact_time: float, reduced_mass: float) -> float:
    """Stiffness (N/m) of an undamped contact that lasts `contact_time`: pi sqrt(m_r / k)."""
    return reduced_mass * (math.pi / contact_time) ** 2


def phases(count: int) -> NDArray[np.float64]:
    """Points spread evenly over [0, 1) at every scale, (count,): multiples of the golden ratio."""
    return np.mod(np.arange(count) * (math.sqrt(5.0) - 1.0) / 2.0, 1.0)


def rms(values: Any) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def order(steps: Any, errors: Any) -> float:
    """Order of convergence: minus the slope of log error over log number of steps."""
    return float(-np.polyfit(np.log(np.asarray(steps, float)), np.log(np.asarray(errors, float)), 1)[0])


def line(**fields: Any) -> dict[str, Any]:
    """Fields of a little line with one of everything, that fills up: a feeder, a bend, a slow end, a side belt."""
    types = {"bottle": kind(), "small": kind(0.03, 0.05, "pet", inertia=3e-5)}

    def pair(a: str, b: str, stiffness: float, law: str, coefficient: float, friction: float) -> dict[str, Any]:
        damping = {"law": law, "coefficient": coefficient}
        return {"between": [a, b], "stiffness": stiffness, "damping": damping, "friction": friction}

    parts: dict[str, Any] = {
        "seed": 7,
        "tick": 0.01,
        "accuracy": {"per_tick": 50},
        "bottle_types": types,
        "contacts": [
            pair("glass", "glass", 5000.0, "paper", 0.5, 0.1),
            pair("glass", "pet", 3000.0, "normal", 0.7, 0.2),
            pair("pet", "pet", 2000.0, "none", 0.0, 0.3),
            pair("glass", "steel", 8000.0, "normal", 1.0, 0.1),
            pair("pet", "steel", 4000.0, "paper", 0.1, 0.15),
        ],
        "base": [{"between": [material, "chain"], "friction": mu} for material, mu in (("glass", 0.4), ("pet", 0.25))],
        "belts": {
            "feeder": belt(0.8, (-1.0, -0.1), 1.5, 0.2, watchdog=0.7),
            "bend": {
                "kind": "curved", "centre": [0.5, 0.4], "inner_radius": 0.3, "width": 0.2, "start_angle": "-90 deg",
                "span": "90 deg", "material": "chain", "speed": 0.7,
                "rails": {"inner": True, "outer": True, "material": "steel"},
            },
            "end": belt(0.15, (1.0, 0.4), 0.6, 0.2, angle="90 deg"),
            "side": belt(0.6, (-1.0, 1.9), 1.2, 0.2),
        },
        "rails": {
            "right": segment((-1.0, -0.1), (0.5, -0.1)),
            "left": polyline([(-1.0, 0.1), (-0.7, 0.1), (-0.5, 0.05), (0.2, 0.05), (0.5, 0.1)]),
            "outer": segment((1.0, 0.4), (1.0, 1.0)),
            "inner": segment((0.8, 1.0), (0.8, 0.4)),
            "fence": polyline([(-0.85, 1.9), (-0.3, 1.97), (0.1, 1.98)]),
        },
        "infeeds": {
            "packed": {
                "bottle": "bottle", "position": [-0.9, 0.0], "direction": 0.0, "speed": 0.8, "gap": 0.004,
                "timing_jitter": 0.01, "lateral_jitter": 0.01,
            },
            "timed": {
                "bottle": "small", "position": [-0.95, 2.0], "direction": -0.05, "speed": 0.3, "rate": 6.0,
                "timing_jitter": 0.05, "lateral_jitter": 0.04, "count": 40,
            },
        },
        "outfeeds": {
            "end": {"region": [[0.7, 0.95], [1.1, 0.95], [1.1, 1.2], [0.7, 1.2]]},
            "side": {"region": [[0.15, 1.8], [0.5, 1.8], [0.5, 2.2], [0.15, 2.2]]},
        },
        "bottles": [{"grid": {"type": "small", "origin": [0.2, -0.06], "rows": 2, "columns": 3, "pitch": 0.061}}],
    }  # fmt: skip
    return {**parts, **fields}
