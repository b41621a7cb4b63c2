"""Commands: setpoints by name, applied together at a tick or refused together with the reason."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from conveyor_sim.line.process_image import ProcessImage


@dataclass(frozen=True)
class CommandOutcome:
    """What became of one set of commands; the fields of conveyor_msgs/CommandOutcome."""

    tick: int
    """Applied at the start of the scan that leads from this tick to the next."""
    source: str
    names: tuple[str, ...]
    values: tuple[float, ...]
    accepted: bool
    reason: str


def refusal(image: ProcessImage, names: Sequence[str], values: Sequence[float]) -> str:
    """Why a set of commands can't be applied, "" if it can."""
    if len(names) != len(values):
        return f"{len(names)} names and {len(values)} values given, expected as many of both"
    seen: set[str] = set()
    for name, value in zip(names, values, strict=True):
        if name not in image.command_names:
            return f"{name}: no such command, expected one of {', '.join(image.command_names) or 'none: no belts'}"
        if name in seen:
            return f"{name}: given twice"
        seen.add(name)
        index = image.command_names.index(name)
        low, high = image.command_min[index], image.command_max[index]
        if not math.isfinite(value) or not low <= value <= high:
            return f"{name}: {value:g} given, expected {low:g} to {high:g} {image.command_units[index]}"
    return ""
