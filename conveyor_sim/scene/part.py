# SPDX-License-Identifier: Apache-2.0
"""Base class of all mappings in a scene file."""

from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, Discriminator, ModelWrapValidatorHandler, ValidationError, model_validator

from conveyor_sim.scene.conversion import in_si_units
from conveyor_sim.scene.problem_count import counting, present_count
from conveyor_sim.scene.problems import Path, Problem, dotted
from conveyor_sim.scene.words import in_words, listed


class Part(BaseModel):
    """A mapping in a scene file: frozen, no unknown fields, texts with units as numbers, its errors in plain words."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True, defer_build=True)

    @model_validator(mode="wrap")
    @classmethod
    def _in_words(cls, data: Any, handler: ModelWrapValidatorHandler["Part"]) -> "Part":
        count = present_count()
        before = count.said if count is not None else 0
        try:
            return handler(in_si_units(cls, data))
        except ValidationError as error:
            if count is not None and count.is_full and count.said == before:
                # All its problems are new and only counted. The scene is refused for the problems before them.
                count.more += error.error_count()
                return cls.model_construct()
            raise in_words(cls, data, error, count) from None


P = TypeVar("P", bound=Part)


def validated(kind: type[P], data: object) -> P | tuple[list[Problem], int]:
    """Return a part from the data of a file, or its problems in words and the number of those beyond MOST_SAID.

    Names of kinds are left out of the paths.
    """
    with counting() as count:
        try:
            part = kind.model_validate(data)
        except ValidationError as error:
            details = error.errors(include_url=False)
            return [Problem(_untagged(item["loc"]), item["msg"]) for item in details], count.more
    # Parts that were only counted are not valid, so they must not pass.
    return kind.model_validate(data) if count.more else part


def _untagged(path: Path) -> Path:
    return tuple(part for part in path if not str(part).startswith("("))


def part_from(kind: type[P], data: object) -> P | str:
    """Return a part from plain data that is not from a scene file, or its first problem in words."""
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        path = dotted(tuple(first["loc"]))
        return f"{path}: {first['msg']}" if path else first["msg"]


def one_of(kinds: dict[str, str]) -> Discriminator:
    """Return the choice of a model by `kind`. Tags have brackets, so that they differ from all names of a scene."""

    def tag(data: Any) -> str | None:
        kind = data.get("kind") if isinstance(data, Mapping) else getattr(data, "kind", None)
        return kinds.get(kind) if isinstance(kind, str) else None

    text = listed([f'"{kind}"' for kind in kinds])
    return Discriminator(tag, custom_error_type="kind", custom_error_message=text, custom_error_context={"text": text})
