"""Gap control in single file: a metering belt opens a wanted gap between bottles that arrive nose to tail.

Behind the metering belt a discharge belt runs faster; a bottle that passes on to it gains on the next one. Touching
bottles of diameter d leave the metering belt at v_m every d / v_m s, so on the discharge belt, at v, they are v d /
v_m apart from front to front: for a gap g the metering belt must run at v d / (d + g). What really comes out is
measured behind the transfer, as the time from one bottle's end to the next one's front times the discharge belt's
speed, and corrects that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from conveyor_sim.control.blocks import limit
from conveyor_sim.control.edges import EyeEdges
from conveyor_sim.control.scan import Inputs, require, speed_command, speed_signal


@dataclass
class GapControl:
    """Meters so that the gap at an eye behind the transfer is as wanted.

    metering, discharge: belts. eye: across the discharge belt, at the height of the bottles' axes. gap, diameter: m.
    lowest, highest: m/s, of the metering belt. gain: of the correction by one bottle, 0 for none; at 1 a lasting
    error is gone after one. A gap of more than `widest` (m; None: twice the gap and a diameter) is one in the supply,
    and corrects nothing.
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
    """m, the last gap that was measured; None before there was one."""
    _factor: float = field(default=1.0, init=False, repr=False)
    _edges: EyeEdges = field(init=False, repr=False)

    def __post_init__(self) -> None:
        require(self.gap > 0.0, f"gap: {self.gap:g} m given, expected more than 0")
        require(self.diameter > 0.0, f"diameter: {self.diameter:g} m given, expected more than 0")
        require(self.lowest <= self.highest, f"highest: {self.highest:g} given, expected {self.lowest:g} or more")
        require(0.0 <= self.gain <= 1.0, f"gain: {self.gain:g} given, expected 0 to 1")
        self._edges = EyeEdges(self.eye)

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """The metering belt's speed, m/s."""
        speed = inputs[speed_signal(self.discharge)]
        edges = self._edges.read(inputs)
        if edges.rises and edges.fell_before is not None:
            self.measured = (edges.rose - edges.fell_before) * speed
            pitch = self.diameter + self.gap
            if self.measured <= (pitch + self.gap if self.widest is None else self.widest):
                # Bounded: a queue or a stop at the eye must not wind the correction up.
                self._factor = limit(0.5, self._factor * (1.0 + self.gain * (self.measured - self.gap) / pitch), 2.0)
        metered = self._factor * speed * self.diameter / (self.diameter + self.gap)
        return {speed_command(self.metering): limit(self.lowest, metered, self.highest)}
