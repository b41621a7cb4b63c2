# SPDX-License-Identifier: Apache-2.0
"""Row pushers: pushers that push by themselves when a row of bottles is complete."""

from collections.abc import Sequence

from conveyor_sim.line.device import ScanContext
from conveyor_sim.line.devices.mover import SWITCHED, Mover
from conveyor_sim.line.devices.region import ZoneDevice
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import Tag, count, switch
from conveyor_sim.scene.parts.movers import Pusher


class RowPusherDevice(Mover):
    """Pusher with a zone. It pushes when the zone has been full for the settling time, and returns from its end."""

    def __init__(self, name: str, part: Pusher, setup: DeviceSetup) -> None:
        super().__init__(name, part, setup)
        self._zone_name, self._setup, self._settle_ticks = part.zone, setup, setup.ticks(part.settle)
        self._zone: ZoneDevice | None = None
        self.auto = True
        self.full_ticks = 0
        """Ticks for which the zone has been full while the pusher was at home."""
        self.strokes = 0
        """Strokes to the end."""

    def own_tags(self, name: str, share: float) -> Sequence[Tag]:
        """Return the tags. share: initial part of the stroke."""
        return (
            *super().own_tags(name, share),
            switch(f"{name}/auto", "command", "On: pushes when its zone is full, and returns from the end.", 1.0),
            count(f"{name}/strokes", "counter", "Strokes to the end.").of("strokes"),
        )

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Take `auto`, or a command of all movers."""
        if name.endswith("/auto"):
            self.auto = value != 0.0
        else:
            super().command(name, value, now)

    def rests(self, now: ScanContext) -> bool:
        """Return False, because it must see when its zone is full."""
        return False

    def begin(self, now: ScanContext) -> None:
        """Start a stroke or return if it is time, then set the motion profile of this tick."""
        stroke = self._shape.stroke
        if self.target == 0.0:
            full = self.auto and self.is_home and self._zone_of().full(now)
            self.full_ticks = self.full_ticks + 1 if full else 0
            if self.full_ticks > self._settle_ticks:
                self._move(stroke, now)
        elif self.auto and self.position >= (1.0 - SWITCHED) * stroke:
            self._move(0.0, now)
        super().begin(now)

    def end(self, now: ScanContext) -> None:
        """Take over the position, and count a stroke that has reached the end."""
        before = self.position
        super().end(now)
        last = (1.0 - SWITCHED) * self._shape.stroke
        self.strokes += before < last <= self.position

    def _move(self, target: float, now: ScanContext) -> None:
        self.target, self.full_ticks = target, 0
        self.plan(now)

    def _zone_of(self) -> ZoneDevice:
        if self._zone is None:  # zones are built after pushers
            self._zone = self._setup.device(ZoneDevice, f"zones/{self._zone_name}")
        return self._zone


def pusher_device(name: str, part: Pusher, setup: DeviceSetup) -> Mover:
    """Build a pusher, or a row pusher if it has a zone."""
    return (Mover if part.zone is None else RowPusherDevice)(name, part, setup)
