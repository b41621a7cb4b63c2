"""Encoder-tracked reject: what an inspection has found bad is followed over the belt's pulses to the rejecter.

A PLC keeps a shift register that is shifted by every pulse, with a bit for each bottle found bad. The same is kept
here as the pulse counts at which those bits arrive, so that it may stop, creep and run at any speed. A bottle is put
to its place within a scan: its edge at the inspection's eye is told with its time, and the belt's speed makes pulses
of the time since.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

from conveyor_sim.control.scan import Inputs, eye_signal, require, speed_signal


@dataclass
class TrackedReject:
    """Fires the rejecter when a bottle found bad is before it.

    belt: with the encoder, belts/<belt>/pulses, of `pulses_per_metre`. inspection: the count of bottles found bad
    (machines/<m>/bad). eye: at the inspection; its rise is where a bottle's way begins. fire: the command
    (machines/<r>/fire), on from half of `window` (m) before `distance` (m from that rise) to half of it behind.
    response: s from the command to the stroke, led by the belt's speed. Choose a window of less than two pitches less
    a diameter, so that no good neighbour is hit, and of more than the belt travels in a scan.
    """

    belt: str
    inspection: str
    eye: str
    fire: str
    distance: float
    window: float
    pulses_per_metre: float
    response: float = 0.0
    _due: deque[float] = field(default_factory=deque, init=False, repr=False)
    """Pulse counts at which bad bottles are before the rejecter, the next one first."""
    _bad: float | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        for name in ("distance", "window", "pulses_per_metre"):
            value: float = getattr(self, name)
            require(value > 0.0, f"{name}: {value:g} given, expected more than 0")
        require(self.response >= 0.0, f"response: {self.response:g} s given, expected 0 or more")

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Whether to fire."""
        pulses, bad = inputs[f"belts/{self.belt}/pulses"], inputs[self.inspection]
        speed = inputs[speed_signal(self.belt)] * self.pulses_per_metre
        found = 0 if self._bad is None else round(bad - self._bad)
        self._bad = bad
        if found:
            since = inputs.time - inputs[eye_signal(self.eye, "rose")]
            self._due.append(pulses - speed * since + self.distance * self.pulses_per_metre)
        # What is commanded now acts over the scan to come: aim at its middle.
        acts_at = pulses + speed * (self.response + 0.5 * inputs.length)
        half = 0.5 * self.window * self.pulses_per_metre
        while self._due and self._due[0] + half < acts_at:
            self._due.popleft()
        return {self.fire: float(bool(self._due) and self._due[0] - half <= acts_at)}
