# SPDX-License-Identifier: Apache-2.0
"""Scenes from a seeded generator, to hold the presets to their promise where nothing was fitted.

The generator came after the bounds on the time step were settled. Layouts and effects take turns, so that all are
there; sizes, speeds, stiffness, damping and friction are drawn. In each a queue comes to rest on a running belt.
What was mended after the first ten had been measured is held to the next five.

    PYTHONPATH=docs/studies python -m unseen_scenes FOLDER    # writes the first ten as scene files
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from random import Random
from typing import Any

from ruamel.yaml import YAML

SEED = 20261122

FIRST, LATER = range(10), range(10, 15)
"""Numbers of the scenes; the later ones are measured once, after all else."""

Data = dict[str, Any]


def unseen_scenes(numbers: Iterable[int] = FIRST) -> Mapping[str, Data]:
    """Return the fields of each scene, by name."""
    scenes = [_scene(number) for number in numbers]
    return {scene["name"]: scene for scene in scenes}


def _scene(number: int) -> Data:
    draw = Random(SEED + number)
    layout, contact, extra = (choices[number % len(choices)] for choices in (LAYOUTS, CONTACTS, EXTRAS))
    radius = draw.uniform(0.025, 0.05)
    bottle = {"radius": _round(radius), "mass": _round(draw.uniform(150.0, 350.0) * radius**2), "material": "glass"}
    speed = draw.uniform(0.15, 0.5)
    scene: Data = {
        "name": f"unseen_{number}",
        "description": ", ".join([layout.__name__[1:].replace("_", " "), contact, extra or "no further effects"]),
        "seed": number,
        "duration": 8.0,
        "slip_limit": draw.choice([0.01, 0.01, 0.02]),
        "bottle_types": {"bottle": bottle},
        "contacts": [_contact(draw, contact, speed, other) for other in ("glass", "steel")],
        "base": [{"between": ["glass", "chain"], "friction": _round(draw.uniform(0.15, 0.45))}],
        **layout(draw, bottle["radius"], speed),
    }
    _EXTRAS[extra](draw, scene)
    return scene


def _round(value: float) -> float:
    return float(f"{value:.3g}")


def _contact(draw: Random, law: str, speed: float, other: str) -> Data:
    elastic, damping = law.split(" with ")
    contact: Data = {"between": ["glass", other], "friction": _round(draw.uniform(0.05, 0.3))}
    if elastic == "hertz":
        contact["hertz_stiffness"] = _round(10.0 ** draw.uniform(6.0, 7.0))
    else:
        contact["stiffness"] = _round(10.0 ** draw.uniform(4.3, 5.3))
    restitution = _round(draw.uniform(0.3, 0.8))
    if damping == "onset damping":
        contact["damping"] = {"law": "onset", "restitution": restitution, "speed": _round(speed)}
    else:
        contact["damping"] = {"law": damping.removesuffix(" damping"), "restitution": restitution}
    return contact


def _stopped_lane(draw: Random, radius: float, speed: float) -> Data:
    """Return a lane one to two and a half bottles wide, with a stop at its end."""
    width, length = radius * draw.uniform(2.2, 5.0), radius * 40.0
    return {
        "belts": {"lane": _straight(length, width, speed)},
        "rails": {"walls": _walls([(0.0, 0.0), (length, 0.0), (length, width), (0.0, width)])},
        "bottles": _in_file(12, (radius * 1.1, width / 2), 2.05 * radius, draw, width / 2 - 1.05 * radius),
    }


def _turn_table(draw: Random, radius: float, speed: float) -> Data:
    """Return a disc with a rim over 300 degrees, at whose end a stop holds the bottles."""
    rim, stop = _round(radius * draw.uniform(9.0, 13.0)), math.radians(300.0)
    end = (rim * math.cos(stop), rim * math.sin(stop))
    scene = _disc(draw, rim, radius, speed, "300 deg", stop - 5.0 * radius / rim)
    scene["rails"]["stop"] = {
        "kind": "segment", "from": [0.5 * end[0], 0.5 * end[1]], "to": [end[0], end[1]], "material": "steel",
    }  # fmt: skip
    return scene


def _turn_table_without_end(draw: Random, radius: float, speed: float) -> Data:
    """Return a disc with a complete rim, along which bottles circulate."""
    return _disc(draw, _round(radius * draw.uniform(9.0, 13.0)), radius, speed, "360 deg", 0.0)


def _disc(draw: Random, rim: float, radius: float, speed: float, span: str, first: float) -> Data:
    at = rim - 1.01 * radius
    angles = [first]
    while len(angles) < 12:
        angles.append(angles[-1] - draw.uniform(1.0, 1.6) * 2.1 * radius / at)
    return {
        "belts": {
            "disc": {
                "kind": "curved", "centre": [0.0, 0.0], "inner_radius": 0.0, "width": rim, "start_angle": 0.0,
                "span": "360 deg", "material": "chain", "speed": _round(speed),
            }
        },
        "rails": {
            "rim": {"kind": "arc", "centre": [0.0, 0.0], "radius": rim, "start_angle": 0.0, "span": span,
                    "material": "steel"},
        },
        "bottles": [{"type": "bottle", "position": [at * math.cos(a), at * math.sin(a)]} for a in angles],
    }  # fmt: skip


def _curved_lane(draw: Random, radius: float, speed: float) -> Data:
    """Return a bend of 150 degrees in single file, closed at its end."""
    inner, width = radius * draw.uniform(8.0, 12.0), radius * draw.uniform(2.2, 2.6)
    outer, middle, span = inner + width, inner + width / 2, math.radians(150.0)
    arc = {"kind": "arc", "centre": [0.0, 0.0], "start_angle": 0.0, "span": span, "material": "steel"}
    angles = [0.2 + 2.2 * radius / middle * n for n in range(8)]
    end = (math.cos(span), math.sin(span))
    return {
        "belts": {
            "bend": {
                "kind": "curved", "centre": [0.0, 0.0], "inner_radius": inner, "width": width, "start_angle": 0.0,
                "span": span, "material": "chain", "speed": _round(speed),
            }
        },
        "rails": {
            "inside": {**arc, "radius": inner},
            "outside": {**arc, "radius": outer},
            "end": {"kind": "segment", "from": [inner * end[0], inner * end[1]], "to": [outer * end[0], outer * end[1]],
                    "material": "steel"},
        },
        "bottles": [{"type": "bottle", "position": [middle * math.cos(a), middle * math.sin(a)]} for a in angles],
    }  # fmt: skip


def _hopper(draw: Random, radius: float, speed: float) -> Data:
    """Rails that lead a wide belt into a mouth which is shut."""
    width, length, mouth = radius * 16.0, radius * 34.0, radius * draw.uniform(2.2, 3.0)
    low, high = (width - mouth) / 2, (width + mouth) / 2
    corner = length * draw.uniform(0.4, 0.6)
    outline = [(0.0, 0.0), (corner, 0.0), (length, low), (length, high), (corner, width), (0.0, width)]
    grid = {"type": "bottle", "origin": [2.0 * radius, 2.5 * radius], "rows": 5, "columns": 7, "pitch": 2.3 * radius}
    return {
        "belts": {"table": _straight(length, width, speed)},
        "rails": {"walls": _walls(outline)},
        "bottles": [{"grid": grid}],
    }


def _gate_lane(draw: Random, radius: float, speed: float) -> Data:
    """Return a single-file lane before a gate that closes it halfway along."""
    width, length = radius * draw.uniform(2.2, 2.8), radius * 60.0
    rails = {
        f"wall_{n}": {"kind": "segment", "from": [0.0, y], "to": [length, y], "material": "steel"}
        for n, y in enumerate((0.0, width))
    }
    gate = {
        "kind": "swing", "from": [length / 2, 0.5 * radius], "to": [length / 2, width - 0.5 * radius],
        "angle": "90 deg", "max_speed": 3.0, "acceleration": 30.0, "material": "steel",
    }  # fmt: skip
    return {
        "belts": {"lane": _straight(length, width, speed)},
        "rails": rails,
        "gates": {"gate": gate},
        "bottles": _in_file(10, (radius * 4.0, width / 2), 2.3 * radius, draw, 0.05 * radius),
    }


def _straight(length: float, width: float, speed: float) -> Data:
    return {
        "kind": "straight", "start": [0.0, 0.0], "angle": 0.0, "length": length, "width": width, "speed": _round(speed),
        "material": "chain",
    }  # fmt: skip


def _walls(points: list[tuple[float, float]]) -> Data:
    return {"kind": "polyline", "points": [list(point) for point in points], "material": "steel"}


def _in_file(count: int, first: tuple[float, float], pitch: float, draw: Random, aside: float) -> list[Data]:
    return [
        {"type": "bottle", "position": [first[0] + n * pitch, first[1] + aside * draw.uniform(-0.9, 0.9)]}
        for n in range(count)
    ]


def _springs(draw: Random, scene: Data) -> None:
    for contact in scene["contacts"]:
        if "hertz_stiffness" in contact:
            contact["tangential"] = {"stiffness_ratio": _round(draw.uniform(0.6, 0.95))}
        else:
            contact["tangential"] = {"stiffness": _round(contact["stiffness"] * draw.uniform(0.3, 0.8)), "damping": 1.0}


def _rings(draw: Random, scene: Data) -> None:
    bottle = scene["bottle_types"]["bottle"]
    bottle["base_radius"] = _round(bottle["radius"] * draw.uniform(0.5, 0.9))


def _implicit(_draw: Random, scene: Data) -> None:
    scene["friction_solver"] = "implicit"


def _static(draw: Random, scene: Data) -> None:
    mass, stiffness = scene["bottle_types"]["bottle"]["mass"], _round(10.0 ** draw.uniform(3.5, 4.0))
    for base in scene["base"]:
        base["tangential"] = {"stiffness": stiffness, "damping": _round(2.0 * math.sqrt(stiffness * mass))}


def _two_types(draw: Random, scene: Data) -> None:
    bottle = scene["bottle_types"]["bottle"]
    share = draw.uniform(0.6, 0.8)
    small = {**bottle, "radius": _round(bottle["radius"] * share), "mass": _round(bottle["mass"] * share**2)}
    scene["bottle_types"]["small"] = small
    for placed in scene["bottles"][::3]:
        placed["type"] = "small"


LAYOUTS: tuple[Callable[[Random, float, float], Data], ...] = (
    _stopped_lane,
    _turn_table,
    _curved_lane,
    _hopper,
    _gate_lane,
    _stopped_lane,
    _turn_table_without_end,
    _curved_lane,
    _hopper,
    _gate_lane,
)
CONTACTS = (
    "linear with normal damping",
    "hertz with normal damping",
    "linear with onset damping",
    "linear with paper damping",
    "hertz with onset damping",
    "linear with normal damping",
    "linear with onset damping",
)
EXTRAS = (
    "", "", "tangential springs", "", "ring bases", "implicit friction", "ring bases", "implicit friction",
    "static friction", "two types",
)  # fmt: skip
_EXTRAS: Mapping[str, Callable[[Random, Data], None]] = {
    "": lambda _draw, _scene: None,
    "tangential springs": _springs,
    "ring bases": _rings,
    "implicit friction": _implicit,
    "static friction": _static,
    "two types": _two_types,
}


def write(folder: Path, numbers: Iterable[int] = FIRST) -> list[Path]:
    """Write the scenes as files and return their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for name, scene in unseen_scenes(numbers).items():
        files.append(folder / f"{name}.yaml")
        with files[-1].open("w", encoding="utf-8") as stream:
            YAML().dump(scene, stream)
    return files


if __name__ == "__main__":
    for file in write(Path(sys.argv[1])):
        print(file)
