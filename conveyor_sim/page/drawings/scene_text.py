# SPDX-License-Identifier: Apache-2.0
"""Text of a scene with imported parts: one line per part, added to a base scene whose comments are kept."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import YAMLError

from conveyor_sim.errors import ConveyorError
from conveyor_sim.scene.words import in_yaml
from conveyor_sim.scene.yaml_lines import LONGEST_TEXT, Document
from conveyor_sim.support.files import FileError, read_file

_LONGEST_LINE = 114

Sections = Mapping[str, Mapping[str, Mapping[str, Any]]]
"""Parts by section of the scene and by name."""


def scene_text(sections: Sections, head: str, base: Path | None = None) -> str:
    """Return the YAML text of a scene. head: comment of the first line. base: scene that the parts are added to.

    Raise ConveyorError if the base can't be read, or has a part of the same name.
    """
    content = _base(base)
    for section, parts in sections.items():
        present = content.setdefault(section, CommentedMap())
        if not isinstance(present, dict):
            raise ConveyorError(f"{base}: {section} is no mapping, expected one that parts can be added to")
        for name, fields in parts.items():
            if name in present:
                raise ConveyorError(f"{base}: {section}.{name} is there already, expected a name that the plan lacks")
            present[name] = _part(name, fields)
    yaml = _yaml()
    stream = io.StringIO()
    yaml.dump(content, stream)
    return f"# {head}\n{stream.getvalue()}"


def key_in_yaml(text: str) -> str:
    """Return a text as a key of YAML, in quotes where they are needed."""
    stream = io.StringIO()
    _yaml().dump({text: None}, stream)
    return stream.getvalue().rstrip().removesuffix(":")


def _yaml() -> YAML:
    yaml = YAML()
    yaml.width = 1_000_000  # a line never breaks between a name and its value
    yaml.brace_single_entry_mapping_in_flow_sequence = True
    yaml.preserve_quotes = True
    return yaml


def _base(base: Path | None) -> Any:
    if base is None:
        return CommentedMap()
    try:
        text = read_file(base, LONGEST_TEXT).decode("utf-8")
    except FileError as error:
        raise ConveyorError(f"{base}: {error}, expected a scene file") from None
    except UnicodeDecodeError:
        raise ConveyorError(f"{base}: not UTF-8 text, expected a scene file in UTF-8") from None
    Document(text, str(base))  # its errors name the line
    try:
        content = _yaml().load(text)
    except YAMLError as error:
        raise ConveyorError(f"{base}: not valid YAML ({' '.join(str(error).split())[:200]})") from None
    if not isinstance(content, dict):
        raise ConveyorError(f"{base}: no mapping, expected a scene file")
    return content


def _part(name: str, fields: Mapping[str, Any]) -> Any:
    """Return a part on one line, or with one line for each field if it is long."""
    if len(name) + len(in_yaml(fields)) <= _LONGEST_LINE:
        return _flow(fields)
    return CommentedMap((key, _flow(value)) for key, value in fields.items())


def _flow(value: Any) -> Any:
    """Return a value that is written on one line."""
    if isinstance(value, Mapping):
        made = CommentedMap((key, _flow(item)) for key, item in value.items())
        made.fa.set_flow_style()
        return made
    if isinstance(value, (list, tuple)):
        row = CommentedSeq(_flow(item) for item in value)
        row.fa.set_flow_style()
        return row
    return value
