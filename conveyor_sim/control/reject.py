# SPDX-License-Identifier: Apache-2.0
"""Encoder-tracked reject: bad bottles of an inspection are tracked by the belt's pulses to the rejecter.

A PLC uses a shift register that every pulse shifts, with one bit per bad bottle. Here the pulse counts are stored at
which these bits arrive, so the belt may run at any speed, creep or stop. Positions are finer than one scan: the
inspection reports a time, and the belt's speed converts the time since then to pulses.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

from conveyor_sim.control.scan import Inputs, pulses_signal, require, speed_signal


@dataclass
class TrackedReject:
    """Rejecter that fires when a bad bottle is in front of it.

    belt: with the encoder, belts/<belt>/pulses, of `pulses_per_metre`; or its drive, "drives/<name>", if the belt runs
    at ratio 1. inspection: the count of bad bottles (machines/<m>/bad). seen: a signal with the time when the last of
    them was seen (machines/<m>/bad_time), or the last bottle at all (photo_eyes/<e>/rose), s. fire: the command
    (machines/<r>/fire). distance: from the place where a bottle is seen to the place where it is hit, m. stroke: travel
    for which `fire` stays on, m. It must exceed the belt's travel in one scan, and be less than the distance of two
    bottles by two such travels, because the rejecter acts on rising edges. response: time from the end of the scan that
    fires to the hit, s; compensated by the belt's speed.
    """

    belt: str
    inspection: str
    seen: str
    fire: str
    distance: float
    stroke: float
    pulses_per_metre: float
    response: float = 0.0
    _due: deque[float] = field(default_factory=deque, init=False, repr=False)
    """Pulse counts at which bad bottles reach the rejecter, the next one first."""
    _bad: float | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        for name in ("distance", "stroke", "pulses_per_metre"):
            value: float = getattr(self, name)
            require(value > 0.0, f"{name}: {value:g} given, expected more than 0")
        require(self.response >= 0.0, f"response: {self.response:g} s given, expected 0 or more")

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return the command to fire, 0 or 1."""
        pulses, bad = inputs[pulses_signal(self.belt)], inputs[self.inspection]
        speed = inputs[speed_signal(self.belt)] * self.pulses_per_metre
        new = 0 if self._bad is None else round(bad - self._bad)
        self._bad = bad
        if new:
            since = inputs.time - inputs[self.seen]
            self._due.append(pulses - speed * since + self.distance * self.pulses_per_metre)
        # A command takes effect at the end of the scan. The nearest scan is chosen.
        hits_at = pulses + speed * (self.response + 1.5 * inputs.length)
        while self._due and self._due[0] + self.stroke * self.pulses_per_metre <= hits_at:
            self._due.popleft()
        return {self.fire: float(bool(self._due) and self._due[0] <= hits_at)}
