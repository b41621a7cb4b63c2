# SPDX-License-Identifier: Apache-2.0
"""Pictures as files; matplotlib is not needed for that."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from conveyor_sim.errors import ConveyorError
from conveyor_sim.support.files import FileError, write_file

PNG: Final[Sequence[str]] = (".png",)
PNG_AND_SVG: Final[Sequence[str]] = (".png", ".svg")
"""Suffixes of the files that a picture is written to."""

Picture = Mapping[str, bytes]
"""Contents of its files by their suffix."""


def write(picture: Picture, stem: Path) -> list[Path]:
    """Write `stem`.png and its like, each whole or not at all. Raises ConveyorError if they can't be written."""
    files = {stem.with_name(stem.name + suffix): content for suffix, content in picture.items()}
    try:
        stem.parent.mkdir(parents=True, exist_ok=True)
        for file, content in files.items():
            write_file(file, content)
    except (OSError, FileError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise ConveyorError(f"{stem}{' and '.join(picture)} can't be written: {reason}") from error
    return list(files)
