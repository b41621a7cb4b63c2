# SPDX-License-Identifier: Apache-2.0
"""Sources of a recorded scene: the files attached to a recording, written to a folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from conveyor_sim.bag.mcap.records import mapped
from conveyor_sim.bag.mcap.salvage import Salvage
from conveyor_sim.bag.reader import mcap_files
from conveyor_sim.errors import BagError
from conveyor_sim.support.files import FileError, write_file


@dataclass(frozen=True)
class WrittenSources:
    """Result of `write_sources`."""

    written: tuple[str, ...]
    """Names from the folder."""
    refused: tuple[str, ...]
    """One sentence for each attachment that is damaged or can't be written."""


def write_sources(bag: Path, folder: Path) -> WrittenSources:
    """Write the attachments of a recording to a new or empty folder, never outside it.

    Raise BagError if there are none, or if the folder is not empty or can't be made.
    """
    written: list[str] = []
    refused: list[str] = []
    files = mcap_files(bag)
    if not files:
        raise BagError(f"{bag}: no MCAP file found, expected a rosbag2 folder or an .mcap file")
    _require_empty(folder)
    for file in files:
        with mapped(file) as data:
            salvage = Salvage(file, data)
        refused += [f"{file}: {damage}" for damage in salvage.damage if damage.startswith("the attachment ")]
        for attachment in salvage.attachments:
            name = PurePosixPath(attachment.name)
            try:
                if name.is_absolute() or ".." in name.parts or not name.parts or name.as_posix() in written:
                    raise FileError("expected the path of another file in the folder")
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                write_file(Path(name), attachment.data, folder)
                written.append(name.as_posix())
            except FileError as error:
                refused.append(f"{attachment.name}: not written: {error}")
            except (OSError, ValueError) as error:
                refused.append(f"{attachment.name}: not written ({getattr(error, 'strerror', None) or error})")
        if salvage.damage and not salvage.attachments:
            raise BagError(f"{file}: is damaged ({salvage.damage[0]}), and has no attachment that can be read")
    if not written and not refused:
        raise BagError(f"{bag}: has no sources attached: its line message holds the text of the scene")
    return WrittenSources(tuple(written), tuple(refused))


def _require_empty(folder: Path) -> None:
    try:
        is_empty = not folder.exists() or not any(folder.iterdir())
    except OSError as error:
        raise BagError(f"{folder}: can't be read ({error.strerror}), expected a new or an empty folder") from error
    if not is_empty:
        raise BagError(f"{folder}: is not empty, expected a new or an empty folder for the sources")
