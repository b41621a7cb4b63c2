# SPDX-License-Identifier: Apache-2.0
"""A controller for small_line.yaml, as a user writes one: a file with a factory."""

from __future__ import annotations

from collections.abc import Mapping

from conveyor_sim.control import Alarm, Controller, Inputs, together
from conveyor_sim.control.level import Count, LevelControl

BOTTLES = "belts/table/bottles"


class TableFull:
    """Raises an alarm while the table carries `high` bottles or more."""

    def __init__(self, high: float) -> None:
        self.high = high
        self.variables = {"count/bottles": 0.0}
        self.record = ("count/*",)
        self.declared_alarms = (Alarm("table full", f"{high:g} bottles on the table", "error", tag=BOTTLES),)

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """The alarm."""
        self.variables = {"count/bottles": inputs[BOTTLES]}
        return {"alarms/table full": float(inputs[BOTTLES] >= self.high)}


def make(high: float) -> Controller:
    """Holds the feeder at `high` bottles."""
    speeds = {"feeder_speed": 0.7, "table_slow": -0.1, "table_fast": 0.3}
    return together(LevelControl(Count(BOTTLES), "feeder", "table", high, high - 2.0, **speeds), TableFull(high))
