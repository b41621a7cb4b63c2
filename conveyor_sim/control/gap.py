# SPDX-License-Identifier: Apache-2.0
"""Gap control in single file: a metering belt opens a set gap between bottles that arrive nose to tail.

The discharge belt behind the metering belt runs faster, so a bottle that passes on to it gains on the next one.
Touching bottles of diameter d leave the metering belt at v_m every d / v_m s. On the discharge belt, at v, their fronts
are v d / v_m apart. For a gap g, the metering belt must therefore run at v d / (d + g). The actual gap is measured
behind the transfer: the time from the end of one bottle to the front of the next, times the speed of the discharge
belt. It corrects the speed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from conveyor_sim.control.blocks import limit
from conveyor_sim.control.edges import EyeEdges
from conveyor_sim.control.scan import Inputs, require, speed_command, speed_signal


@dataclass
class GapControl:
    """Metering that controls the gap at an eye behind the transfer.

    metering, discharge: belts. eye: across the discharge belt, at the height of the bottles' axes. gap, diameter: m.
    lowest, highest: limits of the metering speed, m/s. gain: of the correction per bottle, 0 for none; with 1, a
    constant error is corrected after one bottle. widest: a wider gap (m; None: twice the gap plus a diameter) comes
    from the supply, and corrects nothing.
    """

    metering: str
    discharge: str
    eye: str
    gap: float
    diameter: float
    lowest: float
    highest: float
    gain: float = 0.2
    widest: float | None = None
    measured: float | None = field(default=None, init=False)
    """Last measured gap, m; None before the first one."""
    _factor: float = field(default=1.0, init=False, repr=False)
    _edges: EyeEdges = field(init=False, repr=False)

    def __post_init__(self) -> None:
        require(self.gap > 0.0, f"gap: {self.gap:g} m given, expected more than 0")
        require(self.diameter > 0.0, f"diameter: {self.diameter:g} m given, expected more than 0")
        require(self.lowest <= self.highest, f"highest: {self.highest:g} given, expected {self.lowest:g} or more")
        require(0.0 <= self.gain <= 1.0, f"gain: {self.gain:g} given, expected 0 to 1")
        self._edges = EyeEdges(self.eye)

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return the metering belt's speed, m/s."""
        speed = inputs[speed_signal(self.discharge)]
        edges = self._edges.read(inputs)
        if edges.rises and edges.fell_before is not None:
            self.measured = (edges.rose - edges.fell_before) * speed
            pitch = self.diameter + self.gap
            if self.measured <= (pitch + self.gap if self.widest is None else self.widest):
                # Bounded, so that a queue or a stop at the eye can't wind up the correction.
                self._factor = limit(0.5, self._factor * (1.0 + self.gain * (self.measured - self.gap) / pitch), 2.0)
        metered = self._factor * speed * self.diameter / (self.diameter + self.gap)
        return {speed_command(self.metering): limit(self.lowest, metered, self.highest)}
