# SPDX-License-Identifier: Apache-2.0
"""Overrides: plain data that are laid over the data of a scene file."""

import io
import json
import re
from collections.abc import Mapping
from typing import Any

from ruamel.yaml import YAML

from conveyor_sim.errors import SceneError
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.yaml_lines import Document

FILES = "files"
"""Field of stored overrides that holds the texts of the files that a scene names, by path."""

_SPECIAL = re.compile("[\x7f-\x9f\u2028\u2029\ufeff]")
"""Characters that YAML reads as others unless they are escaped."""


def parse_overrides(text: str) -> dict[str, Any]:
    """Return overrides from the YAML of `Scene.overrides_text` ("": none). Raise SceneError if it is not a mapping."""
    if not text.strip():
        return {}
    data = Document(text, "overrides").data
    if not isinstance(data, dict):
        raise SceneError("overrides: expected a mapping of fields of the scene")
    return data


def plain(value: Any, name: str) -> Any:
    """Return overrides as plain data. Raise SceneError for values that YAML can't represent."""
    if isinstance(value, Mapping):
        return {str(key): plain(item, name) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item, name) for item in value]
    for kind in (bool, int, float, str):
        if isinstance(value, kind):
            return kind(value)
    if value is None:
        return None
    raise SceneError(f"{name} (override): a value of type {type(value).__name__} given, expected what YAML can hold")


def merged(data: Any, changes: Any) -> Any:
    """Return plain data with changes: mappings merge, other values replace."""
    if not (isinstance(data, dict) and isinstance(changes, dict)):
        return changes
    return {**data, **{key: merged(data.get(key), change) for key, change in changes.items()}}


def holds(changes: Any, path: Path) -> bool:
    """Return True if the value at a path, or one above it, comes from the overrides."""
    for part in path:
        if not isinstance(changes, dict):
            return True
        if part not in changes:
            return False
        changes = changes[part]
    return bool(path)


def yaml_text(changes: Any) -> str:
    """Return overrides as YAML, "" without overrides."""
    if not changes:
        return ""
    stream = io.StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.dump(changes, stream)
    return stream.getvalue()


def in_quotes(value: Any) -> str:
    """Return plain data as one line of YAML with all texts in quotes, which is read fast."""
    text = json.dumps(value, ensure_ascii=False)
    return _SPECIAL.sub(lambda match: f"\\u{ord(match[0]):04x}", text)
