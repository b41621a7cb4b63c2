# SPDX-License-Identifier: Apache-2.0
"""A recording as one HTML file, which opens without a network."""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from conveyor_sim.bag.reader import mcap_files, open_bag
from conveyor_sim.errors import ConveyorError
from conveyor_sim.page.bundle import one_file
from conveyor_sim.page.difference import RecordingComparison
from conveyor_sim.page.recording import Detail, PageRecording, text
from conveyor_sim.page.watch import Watch
from conveyor_sim.support.files import FileError, write_file


@dataclass(frozen=True)
class LastAction:
    """The last input of a test before its condition failed."""

    time: float
    """s"""
    text: str


@dataclass(frozen=True)
class FailedCondition:
    """A condition that failed."""

    time: float
    """s"""
    text: str
    since: float | None = None
    """Time at which it was first asserted, s; None: unknown."""
    values: Mapping[str, float] = field(default_factory=dict)
    """Values that the condition read, by signal."""
    forced: Sequence[str] = ()
    """Signals that were forced."""
    action: LastAction | None = None
    """Last input of the test; None: there was none."""


def write_page(
    bag: Path,
    file: Path,
    last: float | None = None,
    failures: Sequence[FailedCondition] = (),
    watch: Watch | None = None,
    trends: Sequence[str] = (),
    other: Path | None = None,
) -> Path:
    """Write a recording as one HTML file. Return its path.

    last: length of the part at the end that is drawn, s; None: all. Events are listed from the beginning. watch: frames
    of the same run that are drawn instead. trends: signals that are shown at first; none: those that change most.
    other: a recording that is shown beside it, at the same times.
    Raise BagError, SceneError, and ConveyorError if the file can't be written, or belongs to the recording.
    """
    bags = [bag] if other is None else [bag, other]
    recorded = [part for one in bags for part in (*mcap_files(one), one / "metadata.yaml") if part.exists()]
    if file.exists() and any(map(file.samefile, recorded)):
        raise ConveyorError(f"--html: {file} given, which is a file of the recording, expected another one")
    with ExitStack() as stack:
        opened = [stack.enter_context(open_bag(one)) for one in bags]
        recordings = [PageRecording(one, Detail()) for one in opened]
        if last is not None:
            end = max(recording.last for recording in recordings)
            for recording in recordings:
                recording.begin_before(end, last)
        if watch is not None and watch.end >= 0:
            recordings[0].first, recordings[0].last = watch.first, watch.end
        head: dict[str, Any] = {"failures": [asdict(failure) for failure in failures], "trends": list(trends)}
        parts: dict[str, bytes] = {}
        if other is not None:
            comparison = RecordingComparison(opened[0], opened[1], math.inf)
            head["compared"] = comparison.head()
            parts["difference/0"] = _deflated(text(comparison.part()))
            parts["peaks/0"] = _deflated(text(comparison.peaks()))
            parts.update(_parts(recordings[1], "other/", {}))
        parts.update(_parts(recordings[0], "", head, None if watch is None or watch.end < 0 else watch.blocks()))
        page = one_file(parts, recordings[0].name)
    try:
        write_file(file, page.encode())
    except FileError as error:
        raise ConveyorError(f"{file}: {error}, expected a file to write") from error
    return file


def _parts(
    recording: PageRecording, prefix: str, more: Mapping[str, Any], blocks: Sequence[bytes] | None = None
) -> Iterator[tuple[str, bytes]]:
    """Yield names and content of the parts. blocks: deflated; None: those of the recording."""
    yield f"{prefix}head", _deflated(text({**recording.head(), **more}))
    yield f"{prefix}fullest", _deflated(text(recording.fullest()))
    yield f"{prefix}story/0", _deflated(recording.story())
    for number in range(recording.blocks) if blocks is None else ():
        yield f"{prefix}block/{number}", _deflated(recording.block(number))
    yield from ((f"{prefix}block/{number}", block) for number, block in enumerate(blocks or ()))


def _deflated(part: bytes) -> bytes:
    return zlib.compress(part, 9)
