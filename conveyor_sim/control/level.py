# SPDX-License-Identifier: Apache-2.0
"""Level control of an accumulation table: the feeder is held while the table is full.

The level comes from a count of bottles, from counters at entry and exit, or from photo-eyes across the table.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from conveyor_sim.control.blocks import COVERED, HYSTERESIS
from conveyor_sim.control.scan import Inputs, eye_signal, require, speed_command


class Level(Protocol):
    """Fill level of a table or buffer."""

    def read(self, inputs: Inputs) -> float:
        """Return the level at this scan. Call it once per scan."""


@dataclass(frozen=True)
class Count:
    """Level from a signal: zones/<zone>/bottles or belts/<belt>/bottles."""

    signal: str

    def read(self, inputs: Inputs) -> float:
        """Return the number of bottles."""
        return inputs[self.signal]


@dataclass(frozen=True)
class Counters:
    """Level from counts: bottles at the start plus those that came in, minus those that left.

    entered, left: signals such as counters/<counter>/forward.
    """

    entered: tuple[str, ...]
    left: tuple[str, ...]
    at_start: float = 0.0

    def read(self, inputs: Inputs) -> float:
        """Return the number of bottles."""
        return self.at_start + sum(inputs[name] for name in self.entered) - sum(inputs[name] for name in self.left)


@dataclass
class Eyes:
    """Level from the number of covered photo-eyes: bottles stand at them.

    eyes: names. on, off: times for which an eye must be blocked or free, s; `on` longer than a passing bottle takes.
    """

    eyes: tuple[str, ...]
    on: float = 1.0
    off: float = 1.0
    _covered: tuple[COVERED, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        require(bool(self.eyes), "eyes: none given, expected the name of a photo-eye or more")
        self._covered = tuple(COVERED(self.on, self.off) for _ in self.eyes)

    def read(self, inputs: Inputs) -> float:
        """Return the number of covered eyes."""
        blocked = [inputs.on(eye_signal(eye)) for eye in self.eyes]
        return sum(block(on, inputs.time) for block, on in zip(self._covered, blocked, strict=True))


@dataclass
class LevelControl:
    """Level control: the feeder is held from level `high` down to `low`; the table runs fast up to `low`, slow above.

    level: bottles (Count, Counters), or covered eyes (Eyes). With one eye at the low mark and one at the high mark, low
    is 0 and high is 2. feeder, table: belts. Speeds in m/s; a low `table_slow` keeps the pressure low while bottles
    stand.
    """

    level: Level
    feeder: str
    table: str
    high: float
    low: float
    feeder_speed: float
    table_slow: float
    table_fast: float
    held_speed: float = 0.0
    _full: HYSTERESIS = field(init=False, repr=False)

    def __post_init__(self) -> None:
        require(self.low <= self.high, f"high: {self.high:g} given, expected low, {self.low:g}, or more")
        self._full = HYSTERESIS(self.low, self.high)

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return the speeds of feeder and table."""
        level = self.level.read(inputs)
        return {
            speed_command(self.feeder): self.held_speed if self._full(level) else self.feeder_speed,
            speed_command(self.table): self.table_fast if level <= self.low else self.table_slow,
        }


def table_level(
    feeder: str = "feeder",
    table: str = "table",
    high_mark: float = 45,
    low_mark: float = 35,
    feeder_speed: float = 1.0,
    table_slow: float = 0.2,
    table_fast: float = 0.3,
) -> LevelControl:
    """Return level control by the count of bottles on the belt `table`.

    The defaults are those of the plant in the paper. Speeds in m/s.
    """
    count = Count(f"belts/{table}/bottles")
    return LevelControl(count, feeder, table, high_mark, low_mark, feeder_speed, table_slow, table_fast)
