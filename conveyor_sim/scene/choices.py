# SPDX-License-Identifier: Apache-2.0
"""Choices of a user among the versions of a scene, as overrides: values of parameters, a variant and a format."""

from collections.abc import Iterable, Mapping
from typing import Any

from conveyor_sim.errors import SceneError
from conveyor_sim.scene.words import shown


def choices(
    parameters: Mapping[str, Any] | None = None, variant: str | None = None, format: str | None = None
) -> dict[str, Any]:
    """Return the overrides for values of parameters, a variant and a format. None: those of the scene's file."""
    given = {"parameters": dict(parameters) if parameters else None, "variant": variant, "format": format}
    return {field: value for field, value in given.items() if value is not None}


def settings_of(texts: Iterable[str]) -> dict[str, Any]:
    """Return values of parameters by name from texts NAME=VALUE. Raise SceneError for other texts and equal names."""
    values: dict[str, Any] = {}
    for text in texts:
        name, sign, value = (part.strip() for part in text.partition("="))
        if not sign or not name or not value:
            raise SceneError(f"set: {shown(text)} given, expected NAME=VALUE such as length=3 m")
        if name in values:
            raise SceneError(f"set: {shown(name)} given twice, expected each parameter once")
        values[name] = _number(value)
    return values


def _number(text: str) -> Any:
    """Return a number for the text of one, any other text unchanged."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text
