# SPDX-License-Identifier: Apache-2.0
"""Conversion of texts such as `33 mm` in the data of a part, by the units of its fields."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from functools import lru_cache
from typing import Any, Literal, NamedTuple, get_args, get_origin

from pydantic import BaseModel

from conveyor_sim.scene.quantities import angle_refused, converted
from conveyor_sim.scene.words import unit_of

_PLAIN = (float, int, bool, type(None))


_any_angle: ContextVar[bool] = ContextVar("any_angle", default=False)


@contextmanager
def any_angle() -> Iterator[None]:
    """Accept numbers of more than a full turn for angles inside this context: those of a recording are in rad."""
    token = _any_angle.set(True)
    try:
        yield
    finally:
        _any_angle.reset(token)


_converted: ContextVar[list[str] | None] = ContextVar("converted", default=None)


@contextmanager
def noting_texts() -> Iterator[list[str]]:
    """Collect the names of fields for whose texts numbers are computed inside this context."""
    names: list[str] = []
    token = _converted.set(names)
    try:
        yield names
    finally:
        _converted.reset(token)


class _Field(NamedTuple):
    units: tuple[str, ...]
    """Unit of its numbers; several for the columns of a list of rows."""
    words: frozenset[str]
    """Texts that it takes beside quantities."""
    is_angle: bool


def in_si_units(kind: type[BaseModel], data: Any) -> Any:
    """Return the data of a part with numbers for the texts of its quantities; without such texts the same object.

    A text that can't be converted becomes a `Unconverted`.
    """
    if not isinstance(data, Mapping):
        return data
    fields = _fields(kind)
    changes = {}
    for name, value in data.items():
        if (field := fields.get(name)) is None or (type(value) in _PLAIN and not field.is_angle):
            continue
        number = _number(field, value, field.units[0] if len(field.units) == 1 else "")
        if number is not value:
            changes[name] = number
    if changes and (noted := _converted.get()) is not None:
        noted += changes
    return {**data, **changes} if changes else data


def _number(field: _Field, value: Any, unit: str) -> Any:
    """Return the value of a field, or of an item in it, in SI units. unit: "" above the columns of a row."""
    if isinstance(value, str):
        return value if value in field.words or not unit else converted(value, unit)
    if isinstance(value, (list, tuple)):
        if not field.is_angle and all(type(item) is float or type(item) is int for item in value):
            return value
        is_row = len(value) == len(field.units) and not any(isinstance(item, (list, tuple)) for item in value)
        units = field.units if is_row else (unit,) * len(value)
        items = [_number(field, item, its) for item, its in zip(value, units, strict=True)]
        return value if all(new is old for new, old in zip(items, value, strict=True)) else items
    if isinstance(value, dict):
        return {key: _number(field, item, unit) for key, item in value.items()}
    if field.is_angle and type(value) in (int, float) and not _any_angle.get():
        return angle_refused(value) or value
    return value


@lru_cache(maxsize=1024)
def _fields(kind: type[BaseModel]) -> Mapping[str, _Field]:
    """Return the fields with a unit by the names under which data may give them."""
    fields = {}
    for name, info in kind.model_fields.items():
        unit = unit_of(info)
        if unit:
            units = tuple(unit.split(", "))
            field = _Field(units, frozenset(_words(info.annotation)), units == ("rad",))
            fields.update(dict.fromkeys((name, info.alias or name), field))
    return fields


def _words(annotation: Any) -> set[str]:
    """Return the texts among the choices of a type."""
    if get_origin(annotation) is Literal:
        return {value for value in get_args(annotation) if isinstance(value, str)}
    return set().union(*(_words(part) for part in get_args(annotation)))
