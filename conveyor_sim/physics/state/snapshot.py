# SPDX-License-Identifier: Apache-2.0
"""State of objects (infeeds, watchdogs, accounts, ...) between ticks as plain data, and its restoration."""

import json
import math
from functools import lru_cache
from typing import Any, get_type_hints

import numpy as np
from pydantic import ConfigDict, TypeAdapter, ValidationError

from conveyor_sim.scene.part import Part

LARGEST = 2**53
"""Largest whole number; ticks, counts and ids are far below."""


def snapshot(part: Any) -> Any:
    """Return the public attributes of an object, or of a dict or sequence of objects, as data that JSON can hold.

    Parts of a scene are left out. Random generators are represented by their state.
    """
    if isinstance(part, dict):
        return {str(key): snapshot(value) for key, value in part.items() if not isinstance(value, Part)}
    if isinstance(part, np.random.Generator):
        return part.bit_generator.state
    if isinstance(part, np.ndarray):
        return part.tolist()
    if isinstance(part, (list, tuple)):
        return [snapshot(value) for value in part]
    if hasattr(part, "__dict__"):
        return snapshot(_public(part))
    return part


def restore(part: Any, kept: Any, name: str = "memory") -> None:
    """Put a `snapshot` of an object, or of a dict of objects, back into an object that is built alike.

    The attributes must be the same, with types of the class's annotations or else of the present values; numbers must
    be finite. Raise ValueError with the reason otherwise.
    """
    now = _public(part)
    entries(kept, now, name)
    kind: Any = type(part)
    hints = {} if isinstance(part, dict) else _hints(kind)
    for key, value in now.items():
        place, data = f"{name}.{key}", kept[key]
        if isinstance(value, np.random.Generator):
            _restore_random(value, data, place)
        elif isinstance(value, np.ndarray):
            value[...] = _array(value.shape, data, place)
        elif hasattr(value, "__dict__"):
            restore(value, data, place)
        else:
            if isinstance(value, dict):
                entries(data, value, place)
            setattr(part, key, typed(hints.get(key, type(value)), data, place))


def entries(kept: Any, expected: Any, name: str) -> None:
    """Raise ValueError unless the plain data are a mapping with the expected keys."""
    if not isinstance(kept, dict) or kept.keys() != set(expected):
        raise ValueError(f"{name} has other entries than {', '.join(map(str, expected)) or 'none'}")


def typed(kind: Any, kept: Any, name: str) -> Any:
    """Return plain data as a type such as `tuple[int, ...]`, because JSON has lists only.

    Numbers must be finite, unless the type allows others. Raise ValueError with the reason for data of another type.
    """
    if kind is type(None):
        if kept is not None:
            raise ValueError(f"{name} {wrong('extra_forbidden')}")
        return None
    try:
        value = _adapter(kind).validate_json(json.dumps(kept), strict=True)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        place = "".join(f"[{part}]" for part in first["loc"])
        raise ValueError(f"{name}{place} {wrong(first['type'])}") from None
    if isinstance(value, int) and abs(value) > LARGEST:
        raise ValueError(f"{name} {wrong('bound')}")
    return value


def wrong(kind: str) -> str:
    """Return what is wrong with a value, by pydantic's name of the error."""
    words = {"missing": "is missing", "extra_forbidden": "should not be there", "finite_number": "is not finite"}
    return words.get(kind, "is not of its type, or out of bounds")


def _public(part: Any) -> dict[str, Any]:
    """Return the attributes or entries that a snapshot holds, by name."""
    if isinstance(part, dict):
        return {str(key): value for key, value in part.items() if not isinstance(value, Part)}
    return _public({name: value for name, value in vars(part).items() if not name.startswith("_")})


@lru_cache(maxsize=1000)
def _hints(kind: Any) -> dict[str, Any]:
    return get_type_hints(kind, include_extras=True)


@lru_cache(maxsize=1000)
def _adapter(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(kind, config=ConfigDict(allow_inf_nan=False))


def _restore_random(generator: np.random.Generator, kept: Any, name: str) -> None:
    entries(kept, generator.bit_generator.state, name)
    try:
        generator.bit_generator.state = kept
    except Exception as error:  # NumPy raises various exceptions
        raise ValueError(f"{name}: not the state of a random generator") from error


def _array(shape: tuple[int, ...], kept: Any, name: str) -> Any:
    kind: Any = float
    for _ in shape:
        kind = list[kind]
    array = np.array(typed(kind, kept, name))
    if array.shape != shape:
        raise ValueError(f"{name} has the shape {array.shape}, expected {shape}")
    if not math.isfinite(array.sum()):
        raise ValueError(f"{name} is not finite")
    return array
