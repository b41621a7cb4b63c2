# SPDX-License-Identifier: Apache-2.0
"""Invariants of axes at every tick: phase in gear, limits of speed and acceleration, jams, and belts on axes."""

from __future__ import annotations

import math

from fuzz.violation import Violation

from conveyor_sim.line.commands.inputs import INJECT, SET, CommandOutcome
from conveyor_sim.scene.gearing import travel_per_radian
from conveyor_sim.scene.parts.axis import CYCLE, Axis
from conveyor_sim.simulation import Simulation

ROUNDING = 1e-8
"""rad, after many turns."""


class AxisWatch:
    """Looks at the axes after every tick. Raises Violation."""

    def __init__(self, simulation: Simulation) -> None:
        self._sim, self._scene = simulation, simulation.scene
        self._last = {f"axes/{name}/phase_shift": 0.0 for name in self._scene.axes}
        """Last accepted values."""

    def check(self, before: dict[str, float], now: dict[str, float], outcomes: list[CommandOutcome]) -> None:
        """Check the axes between two ticks. outcomes: of the inputs of the second one."""
        for outcome in outcomes:
            if outcome.accepted and outcome.operation in (SET, INJECT):
                self._last |= dict(zip(outcome.names, outcome.values, strict=True))
        for name, axis in self._scene.axes.items():
            place = f"axes/{name}"
            if axis.master is not None:
                self._gear(place, axis, now)
            if self._last.get(f"{place}/jammed") and now[f"{place}/position"] != before[f"{place}/position"]:
                raise Violation("moves in a jam", f"{place} at tick {self._sim.tick}")
        speeds = self._sim.belts().actual
        for n, (name, belt) in enumerate(self._scene.belts.items()):
            if belt.axis is not None:
                place = f"axes/{belt.axis}/position"
                turned = float(speeds[n]) * self._scene.tick / travel_per_radian(belt)
                if abs(math.remainder(now[place] - before[place] - turned, CYCLE)) > ROUNDING:
                    raise Violation("belt out of step", f"{name} turned {turned} at tick {self._sim.tick}")

    def _gear(self, place: str, axis: Axis, now: dict[str, float]) -> None:
        """In gear, the phase is that of the master, to rounding."""
        if not now[f"{place}/in_gear"]:
            return
        if now[f"{place}/phase_error"] or now[f"{place}/following_error"]:
            raise Violation("in gear with an error", f"{place} at tick {self._sim.tick}")
        # A master with a following error turns out of phase with its slaves.
        if now[f"axes/{axis.master}/following_error"] or (axis.gear_spacing == CYCLE and axis.ratio % 1.0):
            return
        phase = axis.phase + self._last[f"{place}/phase_shift"]
        wrong = now[f"{place}/position"] - axis.ratio * now[f"axes/{axis.master}/position"] - phase
        if abs(math.remainder(wrong, axis.gear_spacing)) > ROUNDING:
            raise Violation("out of phase in gear", f"{place} by {wrong} at tick {self._sim.tick}")
