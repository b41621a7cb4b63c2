"""What every mapping of a scene file is built on: frozen, no unknown fields, its errors in plain words."""

from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, Discriminator, ModelWrapValidatorHandler, ValidationError, model_validator

from conveyor_sim.scene.problems import dotted
from conveyor_sim.scene.words import in_words, listed


class Part(BaseModel):
    """A mapping in a scene file: frozen, no unknown fields, its errors in plain words."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True, defer_build=True)

    @model_validator(mode="wrap")
    @classmethod
    def _in_words(cls, data: Any, handler: ModelWrapValidatorHandler["Part"]) -> "Part":
        try:
            return handler(data)
        except ValidationError as error:
            raise in_words(cls, error) from None


P = TypeVar("P", bound=Part)


def part_from(kind: type[P], data: object) -> P | str:
    """A part from plain data that is not of a scene file, or the first thing that is wrong with it, in words."""
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        path = dotted(tuple(first["loc"]))
        return f"{path}: {first['msg']}" if path else first["msg"]


def one_of(kinds: dict[str, str]) -> Discriminator:
    """Chooses a model by `kind`; tags are in brackets, so that they can't be taken for names of a scene."""

    def tag(data: Any) -> str | None:
        kind = data.get("kind") if isinstance(data, Mapping) else getattr(data, "kind", None)
        return kinds.get(kind) if isinstance(kind, str) else None

    text = listed([f'"{kind}"' for kind in kinds])
    return Discriminator(tag, custom_error_type="kind", custom_error_message=text, custom_error_context={"text": text})
