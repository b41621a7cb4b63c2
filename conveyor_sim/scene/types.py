# SPDX-License-Identifier: Apache-2.0
"""Types of values in a scene, each with the words for what is expected."""

import math
import re
from dataclasses import dataclass
from datetime import datetime, timezone
from typing import Annotated, Any, Literal

from annotated_types import Ge, Gt, Le, Len
from pydantic import (
    AfterValidator,
    AllowInfNan,
    BeforeValidator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    Strict,
    StringConstraints,
)
from pydantic import ValidationError as _PydanticError
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

COORDINATE_LIMIT = 1e5  # m; farther out a double no longer resolves a contact, and a static grid would not fit memory

TOUCH = 1e-9  # m; below this two things touch or coincide: rounding of coordinates of some metres is 1e-15

LEAST, MOST = 1e-20, 1e20  # in SI units; products and quotients of several quantities stay within a double

XY = tuple[float, float]


@dataclass(frozen=True)
class Holds:
    """Expectation for a container. Problems inside are reported in their own words."""

    text: str


@dataclass(frozen=True)
class Says(Holds):
    """Expectation for the values of a type. All problems inside are reported in these words."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        def in_words(value: Any, validate: core_schema.ValidatorFunctionWrapHandler) -> Any:
            try:
                return validate(value)
            except (_PydanticError, ValueError):
                raise PydanticCustomError("expected", "{text}", {"text": self.text}) from None

        return core_schema.no_info_wrap_validator_function(in_words, handler(source))


@dataclass(frozen=True)
class OrText:
    """Texts that a field takes beside its values and that are replaced before these are validated."""

    words: tuple[str, ...] = ()
    """All texts; empty: every text."""

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        text = {"type": "string", **({"enum": list(self.words)} if self.words else {})}
        return {"anyOf": [text, handler(schema)]}


def parse_start_time(value: Any) -> str:
    """Return a date and time as text in UTC, from such a text or a YAML value. Raise ValueError."""
    if isinstance(value, str):
        value = datetime.fromisoformat(re.sub(r"[zZ]\Z", "+00:00", value.strip()))
    if not isinstance(value, datetime) or value.tzinfo is None:
        raise ValueError("no date and time with a zone")
    moment = value.astimezone(timezone.utc).replace(tzinfo=None)
    if not 1970 <= moment.year <= 2099:
        raise ValueError("out of bounds")
    return f"{moment.isoformat()}Z"


def _sized(value: float) -> float:
    """Return a quantity that other quantities are divided by. Raise an error beyond LEAST and MOST."""
    if value != 0.0 and not LEAST <= abs(value) <= MOST:
        raise PydanticCustomError("size", "{text}", {"text": f"a size from {LEAST:g} to {MOST:g}"})
    return value


def _not_huge(value: Any) -> Any:
    """Return one or several quantities that may be arbitrarily small. Raise an error beyond MOST."""
    if any(abs(number) > MOST for number in (value if isinstance(value, tuple) else (value,))):
        raise PydanticCustomError("size", "{text}", {"text": f"a size of at most {MOST:g}"})
    return value


_small, _sound = AfterValidator(_not_huge), AfterValidator(_sized)
Number = Annotated[float, Strict(), AllowInfNan(False), Says("a number"), _small]
Positive = Annotated[float, Strict(), AllowInfNan(False), Gt(0), Says("a number greater than 0"), _sound]
Limit = Annotated[Positive | Literal["none"], Says('a number greater than 0, or "none"')]
NotNegative = Annotated[float, Strict(), AllowInfNan(False), Ge(0), Says("a number, 0 or greater"), _sound]
Restitution = Annotated[
    float, Strict(), AllowInfNan(False), Gt(0), Le(1), Says("a number greater than 0, at most 1"), _sound
]
Share = Annotated[float, Strict(), Ge(0), Le(1), Says("a number from 0 to 1")]
Tolerance = Annotated[
    float, Strict(), AllowInfNan(False), Gt(0), Le(0.5), Says("a number greater than 0, at most 0.5"), _sound
]
Count = Annotated[int, Strict(), Ge(1), Says("a whole number, 1 or greater")]
Index = Annotated[int, Strict(), Ge(0), Says("a whole number, 0 or greater")]
Seed = Annotated[int, Strict(), Ge(0), Le(2**64 - 1), Says("a whole number from 0 to 2^64 - 1")]
Flag = Annotated[bool, Strict(), Says("true or false")]
Text = Annotated[str, Says("a text")]

_angle_words = 'an angle, a number or a text like "90 deg"'
_span_words = 'an angle greater than 0 and at most a full turn, a number or a text like "90 deg"'
Unchecked = Annotated[float, AllowInfNan(True)]
"""A number that may be non-finite, in snapshots."""

Angle = Annotated[float, Strict(), AllowInfNan(False), Says(_angle_words), _small]
Span = Annotated[
    float,
    Strict(),
    AllowInfNan(False),
    Gt(0),
    Le(2 * math.pi),
    Says(_span_words),
    _sound,
]
NotNegativeAngle = Annotated[
    float,
    Strict(),
    AllowInfNan(False),
    Ge(0),
    Le(math.pi),
    Says('an angle from 0 to half a turn, a number or a text like "0.5 deg"'),
    _sound,
]

_coordinate = Annotated[float, Strict(), AllowInfNan(False), Ge(-COORDINATE_LIMIT), Le(COORDINATE_LIMIT)]
Component = Annotated[float, Strict(), AllowInfNan(False)]
Point = Annotated[
    tuple[_coordinate, _coordinate], Says(f"a point [x, y] of two numbers within +-{COORDINATE_LIMIT:.0f}")
]
Velocity = Annotated[tuple[Component, Component], Says("a velocity [vx, vy] of two numbers"), _small]
Limits = Annotated[tuple[Component, Component], Says("two numbers [least, greatest]"), _small]

# A name becomes part of a ROS topic, which takes these characters only and at most 255 of them.
Name = Annotated[
    str,
    StringConstraints(pattern=r"\A[A-Za-z][A-Za-z0-9_]*\z", max_length=100),
    Says("a name of at most 100 letters, digits and underscores, beginning with a letter"),
]
Where = Annotated[
    str,
    StringConstraints(pattern=r"\A([A-Za-z][A-Za-z0-9_]{0,99}(/[A-Za-z][A-Za-z0-9_]{0,99}){0,2})?\z"),
    Says("one to three names, area/cell/unit, such as packaging/line_1"),
]
StartTime = Annotated[
    str,
    BeforeValidator(parse_start_time),
    Says("a date and time with its zone, from 1970 to 2099, such as 2026-03-01T06:00:00Z"),
]
Pair = Annotated[tuple[Name, Name], Says("two names of materials [one, other]")]
PointList = Annotated[tuple[Point, ...], Len(2), Holds("a list of two or more points [x, y]")]
PolygonList = Annotated[tuple[Point, ...], Len(3), Holds("a list of three or more points [x, y]")]


def quantity(description: str, unit: str = "", **more: Any) -> Any:
    """Return a schema field with its description and SI unit ("1" without dimension, "" if it is no quantity)."""
    return Field(description=description, json_schema_extra={"unit": unit}, **more)


def nanoseconds(seconds: float) -> int:
    """Return seconds as nanoseconds, rounded."""
    return round(seconds * 1e9)


def is_whole_nanoseconds(seconds: float) -> bool:
    """Return True if a time is a whole number of nanoseconds, within the rounding of a double."""
    return math.isclose(seconds * 1e9, nanoseconds(seconds), rel_tol=4e-15, abs_tol=0.0)
