# SPDX-License-Identifier: Apache-2.0
"""The line of a run: a scene with the values of its parameters laid over it, and its controller."""

from __future__ import annotations

import copy
import difflib
import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from conveyor_sim.control.scan import ControlError, Controller
from conveyor_sim.control.st.load import load
from conveyor_sim.errors import ConveyorError, StudyError
from conveyor_sim.scene import Scene, parse_overrides, parse_scene
from conveyor_sim.scene.layout.expanded_parts import expanded_parts
from conveyor_sim.scene.load import chosen_data
from conveyor_sim.scene.overrides import merged
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.words import listed
from conveyor_sim.studies.code import function
from conveyor_sim.studies.setup import Setup

_STEP = re.compile(r"([A-Za-z]\w*)|\[(\d+)\]")


def scene_of(setup: Setup, parameters: Mapping[str, Any], seed: int) -> Scene:
    """Return the scene of a run. Raise SceneError or StudyError if invalid, or any exception of a study function."""
    study = setup.study
    text, name, overrides = setup.text, setup.name, setup.overrides
    if setup.function:
        arguments = study.arguments | _of(setup, parameters, "argument")
        made = function(setup.function, arguments)(**arguments)
        if not isinstance(made, Scene):
            raise StudyError(f"{setup.function}: returned a {type(made).__name__}, expected a Scene")
        text, name, overrides = made.source_text, made.source_name, made.overrides_text

    def laid_over(changes: dict[str, Any]) -> dict[str, Any]:
        """Return the data of the scene with changes, before cells and conveyors are expanded."""
        return chosen_data(text or "{}", name, merged(_data(overrides), changes))

    changes = merged({"seed": seed}, study.overrides)
    for path, value in _of(setup, parameters, "field").items():
        changes = _with_field(laid_over(changes), changes, path, value)
    data = laid_over(changes)
    changes = merged(changes, setup.needs(data))
    start = study.warm_start or 0.0
    duration = data.get("duration", 0.0) if study.duration is None else study.duration
    if isinstance(duration, str):
        duration = parse_scene(text, name, merged(_data(overrides), changes)).duration
    changes["duration"] = start + float(duration)
    return parse_scene(text, name, merged(_data(overrides), changes))


def steps_of(path: str) -> Path:
    """Return the parts of a path such as `contacts[0].friction`."""
    return tuple(name or int(index) for name, index in _STEP.findall(path))


def controller_of(setup: Setup, parameters: Mapping[str, Any]) -> Controller | None:
    """Return a new controller for a run; None for a study without one. Raise ConveyorError if it can't be built."""
    if not setup.controller:
        return None
    try:
        return load(setup.controller, setup.study.settings | _of(setup, parameters, "controller"))
    except ControlError as error:
        raise ConveyorError(str(error)) from error


def _of(setup: Setup, parameters: Mapping[str, Any], kind: str) -> dict[str, Any]:
    """Values by field, argument or parameter of the controller."""
    declared = setup.study.parameters
    pairs = ((getattr(declared[name], kind), value) for name, value in parameters.items() if name in declared)
    return {place: value for place, value in pairs if place is not None}


@lru_cache(maxsize=8)
def _data(text: str) -> dict[str, Any]:
    """YAML as plain data, which is not to be changed."""
    return parse_overrides(text)


def _with_field(data: dict[str, Any], changes: dict[str, Any], path: str, value: Any) -> dict[str, Any]:
    """Return the overrides with one more. A list is overridden as a unit, so its other entries are copied.

    data: of the scene with the overrides so far.
    """
    steps: list[Any] = list(steps_of(path))
    _require_named(data, steps, path)
    first_index = next((place for place, step in enumerate(steps) if isinstance(step, int)), len(steps))
    new: Any = value
    if first_index < len(steps):
        there: Any = data
        for step in steps[:first_index]:
            there = there.get(step) if isinstance(there, dict) else None
        new = copy.deepcopy(there)
        inner = new
        try:
            for step in steps[first_index:-1]:
                inner = inner[step]
            inner[steps[-1]] = value
        except (TypeError, IndexError, KeyError):
            raise StudyError(f"{path}: the scene has no such entry of a list") from None
    for step in reversed(steps[:first_index]):
        new = {step: new}
    changed: dict[str, Any] = merged(changes, new)
    return changed


def _require_named(data: dict[str, Any], steps: list[Any], path: str) -> None:
    """Refuse a path to what the scene does not have by that name: a belt of one field would be missing all others."""
    for _, text in expanded_parts(
        data, {str(steps[0]): {str(steps[1]): {str(step): 0 for step in steps[2:3]}}} if len(steps) > 1 else {}
    ):
        raise StudyError(f"{path}: {text}")
    entries = data.get(steps[0])
    if len(steps) < 3 or not isinstance(entries, dict) or not all(isinstance(one, dict) for one in entries.values()):
        return
    if steps[1] not in entries:
        close = difflib.get_close_matches(str(steps[1]), list(map(str, entries)), n=1)
        wanted = f"did you mean {close[0]}?" if close else "expected " + listed([str(name) for name in entries])
        raise StudyError(f"{path}: no {steps[0]}.{steps[1]} in the scene, {wanted}")
