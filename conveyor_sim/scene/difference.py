# SPDX-License-Identifier: Apache-2.0
"""Comparison of two scenes."""

import json
from collections.abc import Collection
from typing import Any

from conveyor_sim.scene.schema import Scene

_LONGEST = 60  # characters of a value that is shown


def scene_difference(one: Scene, other: Scene, ignored: Collection[str] = ()) -> tuple[str, str, str] | None:
    """Return the first field in which two scenes differ, such as `belts.main.speed`, and its values; None if none.

    Texts and files that the scenes were read from are not compared, nor are the `ignored` fields of a scene.
    """
    return _difference("", _fields(one, ignored), _fields(other, ignored))


def _fields(scene: Scene, ignored: Collection[str]) -> Any:
    return json.loads(json.dumps(scene.model_dump(mode="json", exclude=set(ignored))))


def _difference(path: str, one: Any, other: Any) -> tuple[str, str, str] | None:
    if isinstance(one, list) and isinstance(other, list):
        one, other = dict(enumerate(one)), dict(enumerate(other))
    if not (isinstance(one, dict) and isinstance(other, dict)):
        return None if one == other else (path, _words(one), _words(other))
    for key in [*one, *(key for key in other if key not in one)]:
        place = f"{path}[{key}]" if isinstance(key, int) else f"{path}.{key}".lstrip(".")
        if key not in one or key not in other:
            return (place, _words(one[key]), "nothing") if key in one else (place, "nothing", _words(other[key]))
        if (found := _difference(place, one[key], other[key])) is not None:
            return found
    # The order of belts counts: the last of overlapping belts carries.
    return None if list(one) == list(other) else (path, ", ".join(one), ", ".join(other))


def _words(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."
