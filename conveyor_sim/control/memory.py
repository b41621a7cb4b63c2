# SPDX-License-Identifier: Apache-2.0
"""Memory of a controller as plain data, for checkpoints that an equal controller continues from.

A controller with methods `snapshot` and `restore` does this itself. Of any other, the attributes are stored, and those
of the objects in it: numbers, texts, None, enumerations, lists, tuples, deques, mappings with text keys. Callables are
part of its construction, and not stored.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

from conveyor_sim.control.scan import ControlError, Controller

_PLAIN = (bool, int, float, str, type(None))
_LISTS: dict[type, str] = {list: "list", tuple: "tuple", deque: "deque"}
_MAKE: dict[str, Any] = {word: kind for kind, word in _LISTS.items()}


def snapshot(controller: Controller) -> dict[str, Any]:
    """Return the memory of a controller as JSON can hold it. Raise ControlError if that is impossible."""
    name = type(controller).__qualname__
    return {"class": name, "state": _dump(controller, name)}


def restore(controller: Controller, data: Mapping[str, Any]) -> None:
    """Restore a controller from the memory of an equal one. Raise ControlError for data that do not fit."""
    name = type(controller).__qualname__
    if data.get("class") != name:
        raise ControlError(f"found the memory of a {data.get('class')}, expected that of a {name}")
    try:
        _load(controller, data["state"], name)
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        raise ControlError(f"{name}: found invalid memory ({error}), expected that of a checkpoint") from error


def _own(value: Any) -> bool:
    return callable(getattr(value, "snapshot", None)) and callable(getattr(value, "restore", None))


def _dump(value: Any, where: str) -> Any:
    if isinstance(value, Enum):
        return {"enum": value.name}
    if isinstance(value, _PLAIN):
        return value
    if type(value) in _LISTS:
        return {_LISTS[type(value)]: [_dump(one, f"{where}[{number}]") for number, one in enumerate(value)]}
    if isinstance(value, dict):
        if not all(isinstance(key, str) for key in value):
            raise ControlError(
                f"{where}: found a mapping with other keys than texts, expected texts, as a checkpoint holds them"
            )
        return {"dict": {key: _dump(one, f"{where}[{key!r}]") for key, one in value.items()}}
    if _own(value):
        return {"own": value.snapshot()}
    if not hasattr(value, "__dict__"):
        kind = type(value).__name__
        raise ControlError(
            f"{where}: found a {kind}, expected a type that a checkpoint can hold, or snapshot and restore"
        )
    return {"object": {name: _dump(one, f"{where}.{name}") for name, one in _attributes(value).items()}}


def _attributes(value: Any) -> dict[str, Any]:
    """Return the attributes by name, without callables. Fields of a dataclass count even at their class's defaults."""
    declared = [one.name for one in fields(value)] if is_dataclass(value) else []
    values = {name: getattr(value, name) for name in dict.fromkeys([*declared, *vars(value)])}
    return {name: one for name, one in values.items() if is_dataclass(one) or not callable(one)}


def _load(now: Any, data: Any, where: str) -> Any:
    """Restore an object like the dumped one, and return it."""
    if not isinstance(data, dict):
        return data
    ((kind, inner),) = data.items()
    if kind == "enum":
        return type(now)[inner]
    if kind == "dict":
        then = now if isinstance(now, dict) else {}
        return {key: _load(then.get(key), one, f"{where}[{key!r}]") for key, one in inner.items()}
    if kind == "own":
        now.restore(inner)
        return now
    if kind in _MAKE:
        before = list(now) if type(now) in _LISTS and len(now) == len(inner) else [None] * len(inner)
        return _MAKE[kind](_load(old, one, where) for old, one in zip(before, inner, strict=True))
    if now is None or not hasattr(now, "__dict__") or set(_attributes(now)) != set(inner):
        raise ControlError(f"{where}: found another object in the checkpoint, expected a controller made the same way")
    for name, one in inner.items():
        old = getattr(now, name)
        new = _load(old, one, f"{where}.{name}")
        if new is not old:
            object.__setattr__(now, name, new)  # frozen dataclasses included
    return now
