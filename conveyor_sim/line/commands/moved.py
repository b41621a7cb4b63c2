"""Belts of named drives. The description of a belt's speed names the drive, so that every client knows it."""

import re
from collections.abc import Sequence

from conveyor_sim.line.tag import Tag

_TEXT = "Speed of the surface, {ratio:g} times {drive}/speed."
_PATTERN = re.compile(r"Speed of the surface, \S+ times (drives/\w+)/speed\.")


def moved_text(drive: str, ratio: float) -> str:
    """Return the description of the speed of a belt that a drive ("drives/m1") moves."""
    return _TEXT.format(drive=drive, ratio=ratio)


def moved_belts(tags: Sequence[Tag]) -> dict[str, str]:
    """Return the drive of each belt that a named drive moves: {"belts/one": "drives/m1"}."""
    matches = ((tag.device, _PATTERN.fullmatch(tag.description)) for tag in tags if tag.device_class == "belt")
    return {belt: match[1] for belt, match in matches if match is not None}
