# SPDX-License-Identifier: Apache-2.0
"""Rejects: machines that remove the bottle in front of them when fired."""

from collections.abc import Sequence

from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.edge import RisingEdge
from conveyor_sim.line.devices.region import Region
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import count, switch
from conveyor_sim.scene.parts.reject import Reject


class RejectDevice(Device):
    """Reject of a running line."""

    strokes: tuple[float, ...]
    """Start times of the strokes that have not hit yet, s."""

    def __init__(self, name: str, reject: Reject, setup: DeviceSetup) -> None:
        super().__init__(
            name,
            [
                switch(f"{name}/running", "status", "Responds to fire, and is not stopped.", 1.0, "state"),
                count(f"{name}/rejected", "counter", "Bottles rejected.", adds_to="rejected"),
                count(f"{name}/rejected_bad", "counter", "Bad bottles rejected."),
                count(f"{name}/rejected_good", "counter", "Good bottles rejected."),
                count(f"{name}/missed", "counter", "Strokes that hit no bottle."),
                switch(f"{name}/fire", "command", "Its rising edge starts a stroke that can hit one bottle."),
                switch(f"{name}/stop", "fault", "Does not respond to fire."),
            ],
        )
        self._reject = reject
        self._region = Region(reject.region, setup)
        self._power = setup.power("machines", self)
        self.fire = RisingEdge()
        self.stop = False
        self.strokes = ()
        self.removed = 0
        self.removed_bad = 0
        self.missed = 0

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Apply `fire` at its rising edge, or the fault `stop`."""
        if name.endswith("/stop"):
            self.stop = value != 0.0
        elif self.fire.rises(value) and self._responds:
            self.strokes = (*self.strokes, now.time + self._reject.delay)

    def cut_power(self, now: ScanContext) -> None:
        """Drop the strokes that have not hit yet."""
        self.strokes = ()

    @property
    def _responds(self) -> bool:
        return not self.stop and not (self._power is not None and self._power.taken_by("machines", self.name))

    def rehearse(self, now: ScanContext) -> None:
        """Search the region."""
        self._region.inside(now)

    def take(self, now: ScanContext) -> None:
        """Remove one bottle per stroke, within its window."""
        if not self.strokes:
            return
        bottles = now.state.world.bottles
        targets = sorted((int(bottles.id[slot]), slot) for slot in self._region.inside(now).tolist())
        left = []
        for stroke in self.strokes:
            if now.time >= stroke - 1e-9 and targets:
                bottle, slot = targets.pop(0)
                now.state.remove(slot)
                self.removed += 1
                self.removed_bad += bottle in now.bad
            elif now.time >= stroke + self._reject.window - 1e-9:
                self.missed += 1
            else:
                left.append(stroke)
        self.strokes = tuple(left)

    def states(self, now: ScanContext) -> list[float]:
        """Return running."""
        return [self._responds]

    def counts(self) -> tuple[int, int, int]:
        """Return rejected bottles, and bad ones among them."""
        return self.removed, self.removed_bad, self.removed

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return running, rejected, bad and good ones among them, and strokes without a bottle."""
        return self._responds, self.removed, self.removed_bad, self.removed - self.removed_bad, self.missed
