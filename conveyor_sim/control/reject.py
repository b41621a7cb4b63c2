"""Encoder-tracked reject: what an inspection has found bad is followed over the belt's pulses to the rejecter.

A PLC keeps a shift register that is shifted by every pulse, with a bit for each bottle found bad. The same is kept here
as the pulse counts at which those bits arrive, so the belt may run at any speed, creep or stop. A bottle is put to its
place within a scan: when it was seen is given as a time, and the belt's speed makes pulses of what has passed since.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

from conveyor_sim.control.scan import Inputs, require, speed_signal


@dataclass
class TrackedReject:
    """Fires the rejecter when a bottle found bad is before it.

    belt: with the encoder, belts/<belt>/pulses, of `pulses_per_metre`. inspection: the count of bottles found bad
    (machines/<m>/bad). seen: a signal that gives when the last of them was seen (machines/<m>/bad_time), or the last
    bottle at all (photo_eyes/<e>/rose), s. fire: the command (machines/<r>/fire). distance: m, from where a bottle is
    when it is seen to where it is to be hit. stroke: m that `fire` stays on for; more than the belt moves in a scan,
    and less than the way from one bottle to the next by two such, for a rejecter acts on what rises. response: s from
    the end of the scan that fires until the bottle is hit, led by the belt's speed.
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
    """Pulse counts at which bad bottles are before the rejecter, the next one first."""
    _bad: float | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        for name in ("distance", "stroke", "pulses_per_metre"):
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
            since = inputs.time - inputs[self.seen]
            self._due.append(pulses - speed * since + self.distance * self.pulses_per_metre)
        # A command is carried out by the end of the scan; of all scans, the nearest one is taken.
        hits_at = pulses + speed * (self.response + 1.5 * inputs.length)
        while self._due and self._due[0] + self.stroke * self.pulses_per_metre <= hits_at:
            self._due.popleft()
        return {self.fire: float(bool(self._due) and self._due[0] <= hits_at)}
