"""What a controller remembers, as plain data: a checkpoint holds it, and the same controller goes on from it.

One with methods `snapshot` and `restore` does that itself. Of any other its attributes are taken, and those of the
objects within: numbers, texts, None, enumerations, lists, tuples, deques, mappings by text. What is callable is part
of how it was made, and left out.
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
    """All that a controller remembers, as JSON can hold it. Raises ControlError for what can't be held."""
    name = type(controller).__qualname__
    return {"class": name, "state": _dump(controller, name)}


def restore(controller: Controller, data: Mapping[str, Any]) -> None:
    """Have a controller go on from what another of its kind, made in the same way, remembered. Raises ControlError."""
    name = type(controller).__qualname__
    if data.get("class") != name:
        raise ControlError(f"found what a {data.get('class')} remembered, expected that of a {name}")
    try:
        _load(controller, data["state"], name)
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        raise ControlError(f"{name}: found what it can't have remembered ({error}), expected a checkpoint's") from error


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
            raise ControlError(f"{where}: found a mapping by other than texts, which a checkpoint can't hold")
        return {"dict": {key: _dump(one, f"{where}[{key!r}]") for key, one in value.items()}}
    if _own(value):
        return {"own": value.snapshot()}
    if not hasattr(value, "__dict__"):
        kind = type(value).__name__
        raise ControlError(f"{where}: found a {kind}, expected what a checkpoint can hold, or snapshot and restore")
    return {"object": {name: _dump(one, f"{where}.{name}") for name, one in _attributes(value).items()}}


def _attributes(value: Any) -> dict[str, Any]:
    """By name; those of a dataclass also where they are still as by default, and so its class's."""
    declared = [one.name for one in fields(value)] if is_dataclass(value) else []
    found = {name: getattr(value, name) for name in dict.fromkeys([*declared, *vars(value)])}
    return {name: one for name, one in found.items() if is_dataclass(one) or not callable(one)}


def _load(now: Any, data: Any, where: str) -> Any:
    """What was dumped, put into what is like it; returns it."""
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
            object.__setattr__(now, name, new)  # also of what is frozen, whose parts may change
    return now
