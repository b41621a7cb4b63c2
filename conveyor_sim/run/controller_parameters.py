"""The parameters of a controller as somebody names them: a mapping in YAML, or a file that holds it."""

from __future__ import annotations

from pathlib import Path

from conveyor_sim.errors import ConveyorError
from conveyor_sim.scene.yaml_lines import Document
from conveyor_sim.support.files import MB, FileError, read_file

SUFFIXES = (".yaml", ".yml", ".json")
MOST = 8 * MB
"""Bytes of a file."""


def controller_parameters(given: str, option: str) -> dict[str, object]:
    """By name; "" is none. option: what it is called where it was given. Raises ConveyorError."""
    text, name = given, option
    if given.endswith(SUFFIXES):
        name = given
        try:
            text = read_file(Path(given), MOST).decode("utf-8-sig")
        except (FileError, UnicodeDecodeError) as error:
            raise ConveyorError(f"{option}: {given}: {error}, expected a mapping in YAML") from error
    data = Document(text, name).data if text.strip() else {}
    if not isinstance(data, dict):
        raise ConveyorError(f"{name}: {given!r:.200} given, expected a mapping in YAML, or a .yaml file that holds one")
    return data
