# SPDX-License-Identifier: Apache-2.0
"""Scene of recordings and checkpoints: an expanded one as YAML with every value explicit, and its source files."""

from pathlib import PurePath
from typing import Any

from conveyor_sim.scene.overrides import FILES, in_quotes
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.underlay import underlay_bytes

OVERRIDES_NAME = "overrides.yaml"
"""Name of the overrides among the sources of a scene."""


def recorded_source(scene: Scene) -> tuple[str, str]:
    """Return the text and the overrides (YAML) from which a recording or a checkpoint reads a scene again.

    Scenes that use the layout language are written expanded, because sines and cosines differ between libraries. Other
    scenes have their own text and overrides.
    """
    if not scene.is_expanded:
        return scene.source_text, scene.overrides_text
    # An underlay is the only file that an expanded scene names.
    files = {scene.underlay.file: scene.underlay_url} if scene.underlay is not None and scene.underlay_url else {}
    return expanded_text(scene), f"{FILES}: {in_quotes(files)}\n" if files else ""


def sources_of(scene: Scene) -> dict[str, bytes]:
    """Return the files that an expanded scene was read from, by path from its folder; {} for other scenes.

    Overrides and choices are a file as well.
    """
    if not scene.is_expanded:
        return {}
    files = {PurePath(scene.source_name).name or "scene.yaml": scene.source_text.encode()}
    if scene.given_overrides:
        files[OVERRIDES_NAME] = scene.given_overrides.encode()
    for path, text in scene.source_files.items():
        is_underlay = scene.underlay is not None and path == scene.underlay.file
        files[path] = underlay_bytes(text) if is_underlay else text.encode()
    return files


def expanded_text(scene: Scene) -> str:
    """Return a scene as YAML from its fields. Each part and each item of a list takes a separate line."""
    # The check of this rate depends on whether it is given.
    implied = {"outputs": {"counters"}} if "counters" not in scene.outputs.model_fields_set else None
    data = scene.model_dump(by_alias=True, exclude_none=True, exclude=implied)
    return "".join(line for field, value in data.items() for line in _lines(field, value))


def _lines(field: str, value: Any) -> list[str]:
    if value and isinstance(value, dict):
        return [f"{field}:\n", *(f"  {in_quotes(name)}: {in_quotes(item)}\n" for name, item in value.items())]
    if value and isinstance(value, (list, tuple)):
        return [f"{field}:\n", *(f"  - {in_quotes(item)}\n" for item in value)]
    return [f"{field}: {in_quotes(value)}\n"]
