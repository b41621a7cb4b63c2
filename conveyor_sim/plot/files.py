"""Pictures as files; matplotlib is not needed for that."""

from __future__ import annotations

from pathlib import Path

from conveyor_sim.errors import ConveyorError
from conveyor_sim.support.files import FileError, write_file

Pair = tuple[bytes, bytes]
"""A picture as PNG and as SVG."""


def write(pair: Pair, stem: Path) -> list[Path]:
    """Write `stem`.png and `stem`.svg, each whole or not at all. Raises ConveyorError if they can't be written."""
    files = [stem.with_name(stem.name + suffix) for suffix in (".png", ".svg")]
    try:
        stem.parent.mkdir(parents=True, exist_ok=True)
        for file, content in zip(files, pair, strict=True):
            write_file(file, content)
    except (OSError, FileError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise ConveyorError(f"{stem}.png and .svg can't be written: {reason}") from error
    return files
