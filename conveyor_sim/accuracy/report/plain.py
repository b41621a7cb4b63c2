"""Frozen dataclasses as plain data of JSON and back, exactly; an error says where data is not of its kind, and why."""

from __future__ import annotations

import json
import math
from dataclasses import MISSING, fields, is_dataclass
from types import NoneType, UnionType
from typing import Any, get_args, get_origin, get_type_hints

_EXPECTED = {float: "a number", int: "a whole number", str: "a text", bool: "true or false"}


class Unlike(ValueError):
    """Data that is not of its kind: where, what was found, what was expected."""

    def __init__(self, where: str, found: str, expected: str) -> None:
        super().__init__(f"{where.lstrip('.') or 'all of it'}: found {found}, expected {expected}")


def plain(value: object) -> object:
    """Fields by name, lists, texts, numbers, true, false and null; infinite and undefined numbers as texts."""
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, dict):
        return {name: plain(item) for name, item in value.items()}
    if isinstance(value, tuple):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)  # JSON has no number for it
    return value


def typed(kind: Any, data: Any, where: str = "") -> Any:
    """Return the value of type `kind` from which `plain` produced `data`: dataclass, tuple, dict, X | None, or scalar.

    Raise Unlike if `data` can't come from such a value.
    """
    inner = get_args(kind)
    if get_origin(kind) is UnionType:
        return None if data is None else typed(next(k for k in inner if k is not NoneType), data, where)
    if get_origin(kind) is tuple:
        return _tuple(inner, data, where)
    if get_origin(kind) is dict:
        _expect(isinstance(data, dict), where, data, "fields by name")
        return {name: typed(inner[1], item, f"{where}.{name}") for name, item in data.items()}
    if isinstance(kind, type) and is_dataclass(kind):
        kinds = get_type_hints(kind)
        _expect(isinstance(data, dict), where, data, f"the fields {', '.join(kinds)}")
        # What has a default may be left out: a file of a version that did not have the field yet.
        optional = {field.name for field in fields(kind) if field.default is not MISSING}
        for name in (kinds.keys() ^ data.keys()) - (optional - data.keys()):
            found = f"the field {name}" if name in data else f"no field {name}"
            raise Unlike(where, found, f"the fields {', '.join(kinds)}")
        return kind(**{name: typed(k, data[name], f"{where}.{name}") for name, k in kinds.items() if name in data})
    if kind is float and (type(data) is int or data in ("inf", "-inf", "nan")):
        return float(data)
    _expect(type(data) is kind, where, data, _EXPECTED[kind])
    return data


def _tuple(kinds: tuple[Any, ...], data: Any, where: str) -> tuple[Any, ...]:
    _expect(isinstance(data, list), where, data, "a list")
    if kinds[-1] is Ellipsis:
        kinds = kinds[:1] * len(data)
    _expect(len(data) == len(kinds), where, data, f"a list of {len(kinds)}")
    return tuple(typed(kind, item, f"{where}[{i}]") for i, (kind, item) in enumerate(zip(kinds, data, strict=True)))


def _expect(holds: bool, where: str, data: object, expected: str) -> None:
    if not holds:
        text = json.dumps(data)
        raise Unlike(where, text if len(text) <= 40 else f"{text[:37]}...", expected)
