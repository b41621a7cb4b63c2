# SPDX-License-Identifier: Apache-2.0
"""Scenes with something put wrong: a value that no field takes, an extreme one, a field too many or too few."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass
from typing import Any

from fuzz.case import yaml_text
from fuzz.families import Family
from fuzz.play import check_sentence
from fuzz.scenes import scenes
from fuzz.violation import Violation
from hypothesis import strategies as st

from conveyor_sim.errors import SceneError
from conveyor_sim.physics.model import build_model
from conveyor_sim.scene import parse_scene
from conveyor_sim.scene.accuracy import MOST_STEPS
from conveyor_sim.scene.effect_names import EFFECT_NAMES

Path = tuple[Any, ...]

VALUES = (
    math.nan, math.inf, -math.inf, 0, 0.0, -0.0, -1, 1, 1e308, -1e308, 1e-308, 5e-324, 1e15, 1e-15, 10**30, 2**63,
    True, False, None, "", "nan", ".inf", "90 deg", "1e400 deg", "none", "on", "fine", "\x00", "ü", "a" * 200, [], {},
    [[]], [0, 0], [1e5, -1e5], [math.nan, 0], ["glass", "glass"], {"": 1}, [0] * 30,
)  # fmt: skip


@dataclass(frozen=True)
class Judged:
    """What came of a text."""

    refused: str = ""
    """The refusal; "" if there was none."""


def judge(text: str) -> Judged:
    """Reads a scene and builds its model: both work, or SceneError says why not in words. Raises Violation if not."""
    try:
        model = build_model(parse_scene(text, "scene.yaml"))
    except SceneError as error:
        check_sentence(str(error))
        return Judged(str(error))
    if not (math.isfinite(model.dt) and model.dt > 0.0):
        raise Violation("a time step of no use", f"dt = {model.dt} s")
    if model.steps_per_tick > MOST_STEPS:
        raise Violation("more steps in a tick than can be", f"{model.steps_per_tick:.3g}: {model.dt_reason}")
    return Judged()


@st.composite
def wrong_texts(draw: st.DrawFn, family: Family) -> str:
    """A scene of a family with up to three changes, as text."""
    data = copy.deepcopy(draw(scenes(family)))
    for _ in range(draw(st.integers(0, 3))):
        paths = list(_paths(data))
        path = paths[draw(st.integers(0, len(paths) - 1))]
        _change(draw, data, path)
    return yaml_text(data)


def _change(draw: st.DrawFn, data: Any, path: Path) -> None:
    for part in path[:-1]:
        data = data[part]
    match draw(st.sampled_from(["value", "value", "value", "scaled", "gone", "more", "effects"])):
        case "value":
            data[path[-1]] = copy.deepcopy(draw(st.sampled_from(VALUES)))
        case "scaled" if isinstance(data[path[-1]], float):
            data[path[-1]] *= draw(st.sampled_from([-1.0, 1e-3, 1e3, 1e-12, 1e12]))
        case "gone":
            del data[path[-1]]
        case "more" if isinstance(data, dict):
            data[draw(st.sampled_from(["speed", "kind", "material", "from", "radius", "table", "unheard_of"]))] = draw(
                st.sampled_from(VALUES)
            )
        case "effects" if isinstance(data.get("effects"), dict) if isinstance(data, dict) else False:
            data["effects"][draw(st.sampled_from(EFFECT_NAMES))] = draw(st.sampled_from(["on", "off"]))
        case _:
            pass


def _paths(data: Any, above: Path = ()) -> Any:
    """Paths of all values, those of containers included."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        yield (*above, key)
        yield from _paths(value, (*above, key))
