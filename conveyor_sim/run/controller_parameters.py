# SPDX-License-Identifier: Apache-2.0
"""Parameters of a controller, from YAML text or a file."""

from __future__ import annotations

from pathlib import Path

from conveyor_sim.errors import ConveyorError
from conveyor_sim.scene.yaml_lines import Document
from conveyor_sim.support.files import MB, FileError, read_file

SUFFIXES = (".yaml", ".yml", ".json")
MOST = 8 * MB
"""Largest file, bytes."""


def controller_parameters(value: str, option: str) -> dict[str, object]:
    """Return parameters by name from a YAML mapping or the path of a file that holds one; {} for "".

    option: name of the option or parameter that held the value, for errors. Raises ConveyorError.
    """
    text, name = value, option
    if value.endswith(SUFFIXES):
        name = value
        try:
            text = read_file(Path(value), MOST).decode("utf-8-sig")
        except (FileError, UnicodeDecodeError) as error:
            raise ConveyorError(f"{option}: {value}: {error}, expected a mapping in YAML") from error
    data = Document(text, name).data if text.strip() else {}
    if not isinstance(data, dict):
        raise ConveyorError(f"{name}: {value!r:.200} given, expected a mapping in YAML, or a .yaml file that holds one")
    return data
