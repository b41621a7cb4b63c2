# SPDX-License-Identifier: Apache-2.0
"""Movers with several positions: lane dividers, and guides that are adjusted to formats."""

from collections.abc import Sequence
from dataclasses import replace

from conveyor_sim.line.device import ScanContext
from conveyor_sim.line.devices.mover import SWITCHED, Mover
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import Tag, count, number, switch
from conveyor_sim.scene.parts.movers import Positioned

NAMES = {"dividers": ("lane", "cmd_lane", "Lane"), "adjustable": ("setting", "cmd_setting", "Setting")}
"""By kind: the signal and the setpoint of the position's number, and their word."""

BETWEEN = -1
"""Number of a position in between."""


class PositionedDevice(Mover):
    """Moving rail that goes to the commanded one of several positions."""

    def __init__(self, name: str, part: Positioned, setup: DeviceSetup) -> None:
        least = min(part.positions)
        self._positions = tuple(position - least for position in part.positions)
        super().__init__(name, part, setup)

    def own_tags(self, name: str, share: float) -> Sequence[Tag]:
        """Return the tags. share: initial part of the stroke."""
        signal, setpoint, word = NAMES[name.split("/")[0]]
        last, initial = len(self._positions) - 1, self._number_at(share * self._stroke)
        text = "From 0, at the least of its positions, to 1, at the greatest."
        return (
            number(f"{name}/position", "actual", text, "1", 0.0, 1.0, share),
            replace(
                count(f"{name}/{signal}", "actual", f"{word} at which it stands, -1: in between.", BETWEEN, last),
                initial=initial,
            ),
            switch(f"{name}/in_position", "status", "It stands where the setpoint wants it.", 1.0),
            switch(f"{name}/blocked", "status", "Bottles hold it up, or have pushed it away.", adds_to="state"),
            replace(
                count(f"{name}/{setpoint}", "setpoint", f"{word} to which it moves, from 0.", 0.0, last),
                initial=initial,
            ),
            switch(f"{name}/jammed", "fault", "Stands still, against any load."),
        )

    def target_of(self, value: float) -> float:
        """Return the position (m or rad) of a lane or setting."""
        return self._positions[int(value)]

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the share of the stroke, the number of the position, in position, and blocked."""
        share, _, _, blocked = super().values(now)
        return share, self._number_at(self.position), float(self._is_at(self.target)), blocked

    @property
    def _stroke(self) -> float:
        return max(self._positions)

    def _is_at(self, position: float) -> bool:
        return abs(self.position - position) <= SWITCHED * self._stroke

    def _number_at(self, place: float) -> int:
        """Return the number of the position at a place (m or rad), BETWEEN if there is none."""
        near = (abs(place - position) <= SWITCHED * self._stroke for position in self._positions)
        return next((number for number, is_near in enumerate(near) if is_near), BETWEEN)
