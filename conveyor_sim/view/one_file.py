"""A recording as one HTML file, which opens without a network."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from conveyor_sim.bag.reader import mcap_files, open_bag
from conveyor_sim.errors import ConveyorError
from conveyor_sim.support.files import FileError, write_file
from conveyor_sim.view.bundle import one_file
from conveyor_sim.view.recording import Detail, Recording, text
from conveyor_sim.view.watch import Watch


@dataclass(frozen=True)
class Failure:
    """A condition that failed."""

    time: float
    """s"""
    text: str


def write_page(
    bag: Path,
    file: Path,
    last: float | None = None,
    failures: Sequence[Failure] = (),
    watch: Watch | None = None,
    trends: Sequence[str] = (),
) -> Path:
    """Write a recording as one HTML file, and return it.

    last: only so many seconds at its end are drawn; None: all. What happened is listed from the beginning. watch: what
    is drawn instead, of the same run. trends: signals that are shown at first; none: what there is most to see of.
    Raises BagError, SceneError, and ConveyorError if the file can't be written, or is one of the recording's.
    """
    recorded = [part for part in (*mcap_files(bag), bag / "metadata.yaml") if part.exists()]
    if file.exists() and any(map(file.samefile, recorded)):
        raise ConveyorError(f"--html: {file} given, which is a file of the recording, expected another one")
    with open_bag(bag) as opened:
        recording = Recording(opened, Detail(), last)
        if watch is not None and watch.end >= 0:
            recording.first, recording.last = watch.first, watch.end
            blocks: Iterable[bytes] = watch.blocks()
        else:
            blocks = (_deflated(recording.block(number)) for number in range(recording.blocks))
        head = {**recording.head(), "failures": [vars(failure) for failure in failures], "trends": list(trends)}
        parts = {"head": _deflated(text(head)), "story/0": _deflated(recording.story())}
        parts.update((f"block/{number}", block) for number, block in enumerate(blocks))
        page = one_file(parts, recording.name)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_file(file, page.encode())
    except (FileError, OSError) as error:
        raise ConveyorError(f"{file}: {getattr(error, 'strerror', None) or error}, expected a file to write") from error
    return file


def _deflated(part: bytes) -> bytes:
    return zlib.compress(part, 9)
