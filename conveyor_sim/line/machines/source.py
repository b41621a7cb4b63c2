# SPDX-License-Identifier: Apache-2.0
"""Sources: upstream machines that feed bottles at a rate. A source without room for a bottle is blocked."""

from collections.abc import Sequence

from conveyor_sim.line.device import ScanContext
from conveyor_sim.line.devices.entry import Quality, Scattering
from conveyor_sim.line.devices.infeed import CMD_BOTTLE, Switching, type_tags
from conveyor_sim.line.devices.mover import Mover
from conveyor_sim.line.devices.setup import BAD, JITTER, DeviceSetup
from conveyor_sim.line.machines.machine import MachineDevice
from conveyor_sim.line.machines.stop_reason import BLOCKED, NONE
from conveyor_sim.line.tag import count, seconds, switch
from conveyor_sim.scene.parts.source import Source
from conveyor_sim.scene.types import XY


class SourceDevice(MachineDevice, Scattering, Switching):
    """Source of a running line. Blocked: a bottle is due, and there is no room for it."""

    def __init__(self, name: str, source: Source, setup: DeviceSetup) -> None:
        signals = [
            count(f"{name}/produced", "counter", "Bottles fed.", adds_to="fed"),
            switch(f"{name}/blocked", "status", "A bottle is due, and there is no room.", adds_to="state"),
            seconds(f"{name}/blocked_time", "counter", "Total time blocked."),
            *type_tags(name, source),
        ]
        self.switch_among(source, setup)
        super().__init__(name, source, setup, signals)
        layer = source.layer
        self._offsets = ((0.0, 0.0),) if layer is None else layer.offsets()
        self._batch = len(self._offsets)
        self._pusher = None
        if layer is not None and layer.pusher is not None:
            self._pusher = setup.device(Mover, f"pushers/{layer.pusher}")
        self.quality = Quality(source, setup.random(name, BAD))
        self.scatter(source, lambda: setup.random(name, JITTER))
        # The first bottle takes a cycle, as all others do.
        self.cycle = 1.0 if self._counts_starts else 0.0
        self.fed = 0
        self.blocked_ticks = 0

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Apply the type of new bottles, or a command of all machines."""
        if name.endswith(CMD_BOTTLE):
            self.bottle = int(value)
        else:
            super().command(name, value, now)

    def restored(self, tick: int) -> None:
        """Derive what the state implies, and check the restored type."""
        super().restored(tick)
        self.check_type()

    def feed(self, now: ScanContext) -> None:
        """Feed the bottles that are due, if there is room for all of them."""
        if self._busy:
            self.advance(now)
        cause = NONE
        if self.turn(now):
            places = [self.place(*offset) for offset in self._offsets]
            if not self._has_room(places, now):
                cause = BLOCKED
                self.blocked_ticks += 1
                self.wait()
            elif self.goes_on():
                for place in places:
                    self.quality.judge(self._entry.enter(now.state, *place, self.deflection), now)
                self.draw_scatter()
                self.fed += len(places)
                self.cycle -= 1.0
        self.conclude(cause, now)

    def _has_room(self, places: Sequence[XY], now: ScanContext) -> bool:
        """Return True if a layer or bottle can be set down at places (m), and its pusher is retracted."""
        if self._pusher is not None and not self._pusher.is_home:
            return False
        return self._entry.has_room(now.state, places)

    def counts(self) -> tuple[int, int, int]:
        """Return fed bottles, and bad ones among them."""
        return self.fed, self.quality.bad, 0

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the values in the order of the signals."""
        blocked = self.cause == BLOCKED
        time = self.waited_time("blocked", self.blocked_ticks, now)
        return self.works and not blocked, self.fed, blocked, time, *self.status()

    def states(self, now: ScanContext) -> list[float]:
        """Return running, blocked, state, category and stop reason."""
        blocked = self.cause == BLOCKED
        return [self.works and not blocked, blocked, *self.condition]
