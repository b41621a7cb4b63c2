# SPDX-License-Identifier: Apache-2.0
"""Devices that rest: they are not called in ticks until something wakes them.

Commands, a loss of power, a restore, and bottles near a moving rail wake them.
"""

from collections.abc import Callable, Sequence

import numpy as np

from conveyor_sim.line.device import Device, ScanContext


class CalledDevices:
    """Devices that are called before, and after, the steps of each tick, without those that rest.

    No bit of a run depends on which devices rest, so this is not stored in checkpoints.
    """

    def __init__(self, devices: Sequence[Device], changed: Callable[[frozenset[str]], None]) -> None:
        """Call all devices. changed: takes the names of the resting devices when they change."""
        # Only overridden methods are called.
        self._beginning = [device for device in devices if type(device).begin is not Device.begin]
        self._ending = [device for device in devices if type(device).end is not Device.end]
        self.beginning: list[Device] = []
        self.ending: list[Device] = []
        self._changed = changed
        self._acting = self._stale = False
        self._resting: dict[Device, None] = {}
        self._sleepers = [device for device in devices if type(device).rests is not Device.rests]
        for device in self._sleepers:
            device.on_wake(self._wake)
        self._divide()

    def wake_all(self) -> None:
        """Call all devices again, after a restore."""
        self._resting.clear()
        self._divide()

    def begin(self, now: ScanContext) -> None:
        """Let devices act before the steps of a tick. One that wakes a later device acts before it."""
        self._acting = True
        if self._stale:
            self._divide()
        for device in self.beginning:
            device.begin(now)

    def end(self, now: ScanContext) -> None:
        """Let devices evaluate the steps of a tick. Before, wake those with an axis near which a bottle has come."""
        moving = now.state.world.moving
        if self._axes.size and moving is not None and moving.loaded[self._axes].any():
            for device in [one for one in self._resting if one.axis >= 0 and moving.loaded[one.axis]]:
                self._resting.pop(device)
            self._divide()
        for device in self.ending:
            device.end(now)

    def review(self, now: ScanContext) -> None:
        """Let devices rest from now on that have nothing to do, and end the tick."""
        self._acting = False
        if resting := [device for device in self._awake if device.rests(now)]:
            self._resting.update(dict.fromkeys(resting))
            self._divide()

    def _wake(self, device: Device) -> None:
        if device in self._resting:
            self._resting.pop(device)
            # The commands of a tick may wake many devices: the lists are made once then, as the devices begin.
            self._stale = True
            if self._acting:
                self._divide()

    def _divide(self) -> None:
        """Make the lists of devices to call, in order. They change in place, because `begin` may be using them."""
        self._stale = False
        self.beginning[:] = [device for device in self._beginning if device not in self._resting]
        self.ending[:] = [device for device in self._ending if device not in self._resting]
        self._awake = [device for device in self._sleepers if device not in self._resting]
        self._axes = np.array([device.axis for device in self._resting if device.axis >= 0], np.int64)
        self._changed(frozenset(device.name for device in self._resting))
