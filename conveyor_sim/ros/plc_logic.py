"""What the PLC of the paper's plant decides in one scan: process image in, belt speeds out.

Pure, so a scan can be tested, or run without ROS, by calling it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from conveyor_sim.line.process_image import speed_command


@dataclass(frozen=True)
class PlcSettings:
    """Two belts by name, and the marks (bottles on the table) and speeds (m/s) between which they are switched."""

    feeder: str
    table: str
    high_mark: int
    low_mark: int
    feeder_speed: float
    table_slow: float
    table_fast: float


@dataclass(frozen=True)
class PlcMemory:
    """What a scan hands to the next one."""

    feeder_held: bool = False


def count_signal(belt: str) -> str:
    """Name of the signal that counts the bottles on a belt."""
    return f"belts/{belt}/bottles"


def scan(signals: Mapping[str, float], settings: PlcSettings, memory: PlcMemory) -> tuple[dict[str, float], PlcMemory]:
    """One scan: setpoints by command name, and the memory for the next scan.

    The feeder is held once the table carries `high_mark` bottles and runs again from `low_mark` down; the table runs
    fast while it carries no more than `low_mark`, slow otherwise.
    """
    on_table = signals[count_signal(settings.table)]
    if on_table >= settings.high_mark:
        held = True
    elif on_table <= settings.low_mark:
        held = False
    else:
        held = memory.feeder_held
    setpoints = {
        speed_command(settings.feeder): 0.0 if held else settings.feeder_speed,
        speed_command(settings.table): settings.table_fast if on_table <= settings.low_mark else settings.table_slow,
    }
    return setpoints, PlcMemory(feeder_held=held)
