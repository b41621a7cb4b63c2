"""What the parts of a line remember from tick to tick (infeeds, watchdogs, ...), as plain data and put back."""

import json
import math
from functools import lru_cache
from typing import Any, get_type_hints

import numpy as np
from pydantic import ConfigDict, TypeAdapter, ValidationError

from conveyor_sim.scene.part import Part

LARGEST = 2**53
"""Of whole numbers: ticks, counts and ids are far below."""


def snapshot(part: Any) -> Any:
    """An object by its public attributes, or a dict or sequence of such, as data that JSON can hold.

    Pieces of a scene are left out, random generators taken by their state.
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
    """Put what `snapshot` returned of an object, or of a dict of objects, back into one that is built alike.

    What is given must be alike: the same attributes, of the types of the class's annotations, or else of the values
    that they have now; numbers are finite. Raises ValueError, in words, where it is not.
    """
    now = _public(part)
    entries(kept, now, name)
    kind: Any = type(part)
    hints = {} if isinstance(part, dict) else _hints(kind)
    for key, value in now.items():
        place, given = f"{name}.{key}", kept[key]
        if isinstance(value, np.random.Generator):
            _restore_random(value, given, place)
        elif isinstance(value, np.ndarray):
            value[...] = _array(value.shape, given, place)
        elif hasattr(value, "__dict__"):
            restore(value, given, place)
        else:
            if isinstance(value, dict):
                entries(given, value, place)
            setattr(part, key, typed(hints.get(key, type(value)), given, place))


def entries(kept: Any, expected: Any, name: str) -> None:
    """ValueError unless the plain data are a mapping with the expected keys."""
    if not isinstance(kept, dict) or kept.keys() != set(expected):
        raise ValueError(f"{name} has other entries than {', '.join(map(str, expected)) or 'none'}")


def typed(kind: Any, kept: Any, name: str) -> Any:
    """Plain data as a type such as `tuple[int, ...]`, for JSON has lists only; numbers must be finite, unless the type
    says that they need not be.

    Raises ValueError, in words, for data of another type.
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
    """What is wrong with a value, by pydantic's name of the error."""
    words = {"missing": "is missing", "extra_forbidden": "should not be there", "finite_number": "is not finite"}
    return words.get(kind, "is not of its type, or out of bounds")


def _public(part: Any) -> dict[str, Any]:
    """What is remembered of an object or a dict, by name."""
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
    except Exception as error:  # NumPy's depend on what is wrong
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
