# SPDX-License-Identifier: Apache-2.0
"""Invariants of star wheels, screws, carousels and side belts at every tick: they turn with their axes, or stand."""

from __future__ import annotations

import math

from fuzz.inputs import GEARED
from fuzz.violation import Violation

from conveyor_sim.line.commands.inputs import INJECT, CommandOutcome
from conveyor_sim.scene.parts.axis import CYCLE
from conveyor_sim.simulation import Simulation

ROUNDING = 1e-8
"""rad and m/s, after many turns."""


class WheelWatch:
    """Looks at machines on axes after every tick. Raises Violation."""

    def __init__(self, simulation: Simulation) -> None:
        self._sim, self._scene = simulation, simulation.scene
        self._faults: dict[str, float] = {}
        """Last accepted values."""
        self._shafts = [
            (f"{field}/{name}", f"axes/{part.axis}/position")
            for field in GEARED
            for name, part in getattr(simulation.scene, field).items()
        ]
        self._slipped = {place: 0.0 for place, _ in self._shafts}
        """Angle by which each machine has slipped, rad."""

    def check(self, before: dict[str, float], now: dict[str, float], outcomes: list[CommandOutcome]) -> None:
        """Check the machines between two ticks. outcomes: of the inputs of the second one."""
        for outcome in outcomes:
            if outcome.accepted and outcome.operation == INJECT:
                self._faults |= dict(zip(outcome.names, outcome.values, strict=True))
        for place, axis in self._shafts:
            self._shaft(place, axis, before, now)
        for name, carousel in self._scene.carousels.items():
            self._carousel(f"carousels/{name}", self._scene.stars[carousel.star].pockets, now)
        for name, belt in self._scene.side_belts.items():
            place = f"side_belts/{name}"
            speed, jammed = now[f"{place}/speed"], self._faults.get(f"{place}/jammed")
            # An axis that takes up its following error may be faster than its rate.
            most = max(map(abs, belt.speed_limits)) if belt.axis is None else math.inf
            if (jammed and speed) or not -most <= speed <= most:
                raise Violation("side belt", f"{place} at {speed} m/s, jammed: {jammed}, at tick {self._sim.tick}")

    def _shaft(self, place: str, axis: str, before: dict[str, float], now: dict[str, float]) -> None:
        """A machine has the motion of its axis, but for what it slips; a jam holds both."""
        turned, angle = now[axis] - before[axis], now[f"{place}/angle"] - before[f"{place}/angle"]
        if self._faults.get(f"{place}/jammed") and turned:
            raise Violation("moves in a jam", f"{axis} with {place} at tick {self._sim.tick}")
        slipped = math.remainder(turned - angle, CYCLE)
        left = self._faults.get(f"{place}/slip", 0.0) - self._slipped[place]
        self._slipped[place] += slipped
        # It slips towards the injected angle, and not beyond.
        if slipped * math.copysign(1.0, left) < -ROUNDING or abs(slipped) > abs(left) + ROUNDING:
            raise Violation("wheel off its axis", f"{place} slips by {slipped} of {left} rad at tick {self._sim.tick}")

    def _carousel(self, place: str, pockets: int, now: dict[str, float]) -> None:
        if now[f"{place}/held"] > pockets:
            raise Violation("too full", f"{place} works on {now[f'{place}/held']} in {pockets} pockets")
