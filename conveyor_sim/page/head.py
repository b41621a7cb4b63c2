# SPDX-License-Identifier: Apache-2.0
"""Constant part of a recording for the page, as JSON: shapes of the plant, tags, meaning of indices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from conveyor_sim.page.block import FORCE_FRAMES, LEAST_FORCE, LEVELS, MM, SIGNAL_STEPS, UNKNOWN
from conveyor_sim.page.drawings.underlay import ShownUnderlay, shown_underlay
from conveyor_sim.page.story import fields
from conveyor_sim.scene import Scene
from conveyor_sim.scene.bodies import BodyShape
from conveyor_sim.scene.driven import speed_owner
from conveyor_sim.scene.geometry import BeltShape, RailShape, named_surfaces, rail_shapes, surface_shapes
from conveyor_sim.scene.marks import marks_of
from conveyor_sim.scene.moving import mover_shape, movers_of
from conveyor_sim.scene.parts.panel import PanelPart
from conveyor_sim.scene.wheel_bodies import wheel_bodies

_ARC_POINTS = 96
_POCKET_POINTS = 16
_DIGITS = 5
"""Decimal places of lengths in m."""


def head(line: Any, scene: Scene) -> dict[str, Any]:
    """Return the constant data of the page and the scales of the changing data, from a decoded Line message."""
    signals = list(line.signal_names)
    return {
        **plan_head(scene),
        "run": line.run_id,
        "seed": int(line.seed),
        "where": line.where,
        "tick": float(line.tick_ns * 1e-9),
        "types": [
            {"name": name, "radius": float(radius)}
            for name, radius in zip(line.bottle_types, line.type_radius, strict=True)
        ],
        "drives": {
            f"belts/{name}": "/".join(map(str, speed_owner(scene, name)))
            for name, belt in scene.belts.items()
            if belt.has_foreign_drive
        },
        "signals": signals,
        "commands": list(line.command_names),
        "panel": [_panel_part(name, part) for name, part in scene.panel.items()],
        "tags": _tags(line),
        "fields": fields(),
        "steps": {
            "mm": MM,
            "signal": SIGNAL_STEPS,
            "force": LEAST_FORCE,
            "levels": LEVELS,
            "unknown": UNKNOWN,
            "forceFrames": FORCE_FRAMES,
        },
    }


def _panel_part(name: str, part: PanelPart) -> dict[str, Any]:
    """Return the fields of a part of the operator panel that decide its look."""
    return {**part.model_dump(mode="json"), "name": name, "label": part.label or name.replace("_", " ")}


def plan_head(scene: Scene) -> dict[str, Any]:
    """Return what the page draws of a scene that does not run: surfaces, rails, moving rails, bodies and marks."""
    shapes = surface_shapes(scene)
    named = list(named_surfaces(shapes).values())
    return {
        "scene": scene.name,
        "description": scene.description,
        "underlay": _underlay(scene),
        "surfaces": [{**_surface(shape), "named": shape in named} for shape in shapes],
        "rails": [_points(shape.outline(_ARC_POINTS)) for shape in rail_shapes(scene)],
        "movers": [
            {
                "name": body.name,
                "from": piece.ends[0],
                "to": piece.ends[1],
                "pivot": body.pivot,
                "present": 1.0 if body.cam is None else body.cam.end / axis.stroke,
                "along": body.along,
                "turning": body.turning,
                "stroke": axis.stroke,
                "first": axis.first,
            }
            for bodies, axis in (mover_shape(path, mover) for path, mover in movers_of(scene))
            for body in bodies
            for piece in body.pieces
        ],
        "bodies": _bodies(wheel_bodies(scene)),
        "marks": [
            {
                "look": mark.look,
                "kind": mark.kind,
                "name": mark.name,
                "points": _points(mark.points),
                "direction": mark.direction,
            }
            for mark in marks_of(scene)
        ],
    }


def _bodies(bodies: Sequence[BodyShape]) -> list[dict[str, Any]]:
    """Return bodies of star wheels, screws and side belts, with lags from the first body of each machine.

    The angle of a machine is that of its first body.
    """
    first: dict[str, float] = {}
    for body in bodies:
        first.setdefault(body.name, body.lag)
    return [_body(body, body.lag - first[body.name]) for body in bodies]


def _body(body: BodyShape, lag: float) -> dict[str, Any]:
    """Return a body: its outline at displacement 0, and its motion. lag: behind the angle of its machine, rad.

    Parts of cams are [u, s, ds/du, d2s/du2]; null without a cam.
    """
    return {
        "name": body.name,
        "outline": _points(RailShape(body.name, body.material, body.pieces).outline(_POCKET_POINTS)),
        "pivot": body.pivot,
        "along": body.along,
        "turning": body.turning,
        "lag": lag,
        "period": body.period,
        "cam": None if body.cam is None else {"parts": body.cam.parts, "end": body.cam.end},
        "slide": None if body.slide is None else {"direction": body.slide.direction, "parts": body.slide.cam.parts},
    }


def _underlay(scene: Scene) -> dict[str, Any] | None:
    """Return the underlay of a scene; None if there is none that can be shown."""
    shown = shown_underlay(scene)
    return asdict(shown) if isinstance(shown, ShownUnderlay) else None


def _surface(shape: BeltShape) -> dict[str, Any]:
    """Return a surface. belt: index of its belt, None for a plate; named: True if its belt's name is drawn on it."""
    return {
        "belt": shape.belt,
        "name": shape.belt_name,
        "ratio": shape.ratio,
        "clockwise": shape.clockwise,
        "kind": shape.kind,
        "outline": _points(shape.outline(_ARC_POINTS)),
        "corner": shape.corner,
        "angle": shape.angle,
        "length": shape.length,
        "width": shape.width,
        "centre": shape.centre,
        "inner": shape.inner_radius,
        "start": shape.start_angle,
        "span": shape.span,
    }


def _points(points: Any) -> list[list[float]]:
    rounded: list[list[float]] = np.round(np.asarray(points, dtype=np.float64), _DIGITS).tolist()
    return rounded


def _tags(line: Any) -> list[dict[str, Any]]:
    """Return all tags; of a recording of format 1, the signals."""
    return [
        {
            "name": tag.name,
            "kind": tag.kind,
            "role": tag.role,
            "unit": tag.unit,
            "min": _finite(tag.min),
            "max": _finite(tag.max),
            "initial": _finite(tag.initial),
            "texts": ", ".join(
                f"{value} {text}" for value, text in zip(tag.state_values, tag.state_texts, strict=True)
            ),
            "description": tag.description,
            "device": tag.device,
            "class": tag.device_class,
        }
        for tag in line.tags
    ]


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
