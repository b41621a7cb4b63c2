# SPDX-License-Identifier: Apache-2.0
"""Sentences for pydantic's errors: value, expectation, unit."""

import difflib
import math
from collections.abc import Collection, Iterator, Mapping
from itertools import islice
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails, InitErrorDetails, PydanticCustomError

from conveyor_sim.scene.problem_count import ProblemCount
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.quantities import Unconverted, example_of
from conveyor_sim.scene.types import Holds

_LONGEST_VALUE = 60
_LONGEST_NAME = 100
"""Longest unknown name for which a similar one is looked up. The time grows with its length."""
_MOST_NAMES = 500
"""Largest number of names among which a similar one is looked up."""
_LISTED = 20
"""Largest number of names that a sentence lists."""


def shown(value: Any) -> str:
    """Return the value of a field for an error: as YAML, cut short when it is long, without rendering the rest."""
    text = ""
    for piece in _pieces(value):
        text += piece[: _LONGEST_VALUE + 1]
        if len(text) > _LONGEST_VALUE:
            break
    return cut(text)


def cut(text: str) -> str:
    """Return a text for an error, cut if it is long."""
    return text if len(text) <= _LONGEST_VALUE else text[: _LONGEST_VALUE - 4] + " ..."


def in_yaml(value: Any) -> str:
    """Return a value as one line of YAML."""
    return "".join(_pieces(value))


def _pieces(value: Any) -> Iterator[str]:
    """Yield the text of a value as YAML, in order."""
    if isinstance(value, Mapping):
        for index, (key, item) in enumerate(value.items()):
            yield f"{', ' if index else '{'}{key}: "
            yield from _pieces(item)
        yield "}" if value else "{}"
    elif isinstance(value, (list, tuple)):
        for index, item in enumerate(value):
            yield ", " if index else "["
            yield from _pieces(item)
        yield "]" if value else "[]"
    else:
        yield _scalar(value.value if isinstance(value, Unconverted) else value)


def _scalar(value: Any) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        special = {math.inf: ".inf", -math.inf: "-.inf"}
        return ".nan" if math.isnan(value) else special.get(value, repr(value).removesuffix(".0"))
    return '"' + value.replace("\n", "\\n") + '"' if isinstance(value, str) else str(value)


def some_of(names: Collection[str]) -> str:
    """Return the first names of many, and the number of the others."""
    more = len(names) - _LISTED
    return ", ".join(islice(names, _LISTED)) + (f" and {more} others" if more > 0 else "")


def listed(words: list[str]) -> str:
    """Return words as `a, b or c`."""
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " or " + words[-1]


def expectation(field: FieldInfo) -> str:
    """Return the expectation of a field with its unit: `a number greater than 0 (m)`."""
    says = [m.text for m in field.metadata if isinstance(m, Holds)]
    text = says[-1] if says else _expectation_of(field.annotation)
    unit = unit_of(field)
    return f"{text} ({unit})" if unit not in ("", "1") else text


def unit_of(field: FieldInfo) -> str:
    """Return the SI unit of a field: "1" without dimension, "" if it is no quantity."""
    extra = field.json_schema_extra
    return str(extra.get("unit", "")) if isinstance(extra, dict) else ""


def _expectation_of(annotation: Any) -> str:
    origin = get_origin(annotation)
    if origin is Annotated:
        says = [m.text for m in annotation.__metadata__ if isinstance(m, Holds)]
        return says[-1] if says else _expectation_of(get_args(annotation)[0])
    if origin is Literal:
        return listed([f'"{value}"' for value in get_args(annotation)])
    if origin in (Union, UnionType):
        (something,) = (part for part in get_args(annotation) if part is not type(None))
        return _expectation_of(something)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return fields_of(annotation)
    raise TypeError(f"{annotation} has no words; mark it with Says or Holds")


def field_names(model: type[BaseModel]) -> dict[str, FieldInfo]:
    """Return the fields of a model by the name in a scene file."""
    return {field.alias or name: field for name, field in model.model_fields.items()}


def fields_of(model: type[BaseModel]) -> str:
    """Return `a mapping with the fields a, b and c`; only the required fields if there are many."""
    names = field_names(model)
    needed = [name for name, field in names.items() if field.is_required()]
    if needed and len(names) > 6:
        return "a mapping with at least the fields " + ", ".join(needed)
    return "a mapping with the fields " + ", ".join(names)


def in_words(
    model: type[BaseModel], data: Any, error: ValidationError, count: ProblemCount | None = None
) -> ValidationError:
    """Return the error with problems of the model's fields in words (error type "said"); others pass unchanged.

    data: of the model, before texts of quantities became numbers. count: bounds the problems in words; None: no bound.
    """
    details: list[InitErrorDetails] = []
    for problem in error.errors(include_url=False):
        if count is not None and problem["type"] != "said":
            if count.is_full:
                count.more += 1
                continue
            count.said += 1
        details.append(_said(model, data, problem))
    return ValidationError.from_exception_data(error.title, details)


def _said(model: type[BaseModel], data: Any, problem: ErrorDetails) -> InitErrorDetails:
    loc, value = problem["loc"], problem["input"]
    text = _sentence(model, data, problem)
    if problem["type"] == "kind" and isinstance(value, Mapping):
        loc = (*loc, "kind")
    if loc and loc[-1] == "[key]":
        loc = loc[:-1]
    return {"type": PydanticCustomError("said", "{text}", {"text": text}), "loc": loc, "input": value}


def _sentence(model: type[BaseModel], data: Any, problem: ErrorDetails) -> str:
    kind, loc, value = problem["type"], problem["loc"], problem["input"]
    if kind == "said":
        return str(problem["ctx"]["text"])
    if not loc:
        return f"{shown(value)} given, expected {fields_of(model)}"
    names = field_names(model)
    if kind in ("extra_forbidden", "invalid_key"):
        return _unknown(str(loc[0]), list(names))
    field = names[str(loc[0])]
    if kind == "missing":
        return f"missing, expected {expectation(field)}"
    if kind == "kind":
        return _wrong_kind(value, str(problem["ctx"]["text"]))
    if loc[-1] == "[key]":
        return f"{shown(value)} given as a name, expected {problem['ctx']['text']}"
    given = _given(data, loc, value)
    text = expectation(field)
    if kind == "size" or (kind == "expected" and len(loc) > 1):
        unit = unit_of(field)
        text = str(problem["ctx"]["text"]) + (f" ({unit})" if unit not in ("", "1") else "")
    unconverted = _first_unconverted(value)
    if unconverted is None:
        return f"{shown(given)} given, expected {text}"
    example = example_of(unit_of(field).partition(", ")[0])
    such = f", such as {example}" if example and example not in text else ""
    return f"{shown(given)} given, expected {text}{such}; found {unconverted.reason}"


def _given(data: Any, loc: Path, value: Any) -> Any:
    """Return the value at a place in the data; `value` if there is no such place."""
    for part in loc:
        inside = (
            part in data if isinstance(data, Mapping) else isinstance(part, int) and isinstance(data, (list, tuple))
        )
        if not inside:
            return value
        data = data[part]
    return data


def _first_unconverted(value: Any) -> Unconverted | None:
    """Return the first refused quantity in the value of a field."""
    if isinstance(value, (list, tuple)):
        return next((one for item in value if (one := _first_unconverted(item)) is not None), None)
    return value if isinstance(value, Unconverted) else None


def _unknown(name: str, names: list[str]) -> str:
    return f"no such field, {did_you_mean(name, names)}"


def did_you_mean(name: str, names: list[str]) -> str:
    """Return the expectation for an unknown name: the one that it resembles, or all of them."""
    is_short = len(name) <= _LONGEST_NAME and len(names) <= _MOST_NAMES
    close = difflib.get_close_matches(name, names, n=1) if is_short else []
    if close:
        return f"did you mean {close[0]}?"
    return f"expected {listed(names)}" if len(names) <= _LISTED and names else f"expected {some_of(names) or 'none'}"


def _wrong_kind(value: Any, kinds: str) -> str:
    if not isinstance(value, Mapping):
        return f"{shown(value)} given, expected a mapping with kind {kinds}"
    if "kind" not in value:
        return f"missing, expected {kinds}"
    return f"{shown(value['kind'])} given, expected {kinds}"
