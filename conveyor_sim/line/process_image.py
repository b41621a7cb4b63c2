"""The process image: the names, units and limits of what a controller may read and write, once a tick."""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class ProcessImage:
    """Two tables by name: signals (read) and commands (write). Values travel in the order of these tuples."""

    signal_names: tuple[str, ...]
    signal_units: tuple[str, ...]
    command_names: tuple[str, ...]
    command_units: tuple[str, ...]
    command_min: tuple[float, ...]
    command_max: tuple[float, ...]


def speed_command(belt: str) -> str:
    """Name of a belt's speed setpoint; also the topic that takes it."""
    return f"belts/{belt}/cmd_speed"


def process_image(
    belts: Iterable[tuple[str, float, float]], infeeds: Iterable[str], outfeeds: Iterable[str]
) -> ProcessImage:
    """Build the tables from the line's parts; belts as (name, lowest speed, highest speed) in m/s."""
    belts = tuple(belts)
    signals = [(f"belts/{name}/speed", "m/s") for name, _, _ in belts]
    signals += [(f"belts/{name}/bottles", "1") for name, _, _ in belts]
    for infeed in infeeds:
        signals += [(f"infeeds/{infeed}/fed", "1"), (f"infeeds/{infeed}/blocked", "1")]
    signals += [(f"outfeeds/{outfeed}/removed", "1") for outfeed in outfeeds]
    return ProcessImage(
        signal_names=tuple(name for name, _ in signals),
        signal_units=tuple(unit for _, unit in signals),
        command_names=tuple(speed_command(name) for name, _, _ in belts),
        command_units=("m/s",) * len(belts),
        command_min=tuple(low for _, low, _ in belts),
        command_max=tuple(high for _, _, high in belts),
    )
