# SPDX-License-Identifier: Apache-2.0
"""Carousels: tools at the pockets of a star wheel, which work on carried bottles between two angles."""

import math
from collections.abc import Sequence

import numpy as np

from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.bottle_work import BottleWork, work_tags
from conveyor_sim.line.devices.geared_machine import StarDevice
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import count, switch
from conveyor_sim.scene.parts.carousel import Carousel
from conveyor_sim.scene.parts.work import BAD
from conveyor_sim.scene.star_places import wheels_of

NONE, IDLE = -1, -2
"""In place of the id of a bottle: an empty pocket; a pocket whose tool does not work."""

WITHIN = 0.5
"""Greatest distance of a carried bottle's axis from the centre of its pocket, in radii of the pocket."""


class CarouselDevice(BottleWork, Device):
    """Carousel of a running line.

    A tool begins its work when its pocket passes `from` with a bottle, and ends it at `to` with the same bottle. Time
    plays no part: a wheel that stands in between continues afterwards.
    """

    bottles: list[int]
    """Bottle under the tool of each pocket between the two angles, by its id; NONE or IDLE."""
    done: list[int]
    """Last bottle on which the work was complete, of each pocket. It passes again if the wheel has turned backward."""
    left_out: list[int]
    """Last bottle that was counted as skipped, of each pocket. It passes again if the wheel has turned backward."""

    def __init__(self, name: str, part: Carousel, setup: DeviceSetup) -> None:
        """Build the tags, and find the pocket at each of the two angles."""
        self._wheel = wheels_of(setup.scene.stars)[part.star]
        self._star = setup.device(StarDevice, f"stars/{part.star}")
        star = self._wheel.part
        super().__init__(
            name,
            [
                count(f"{name}/processed", "counter", "Bottles on which the work is complete."),
                *work_tags(name, part),
                count(f"{name}/held", "actual", "Bottles under a tool at work.", high=star.pockets),
                count(f"{name}/missing", "counter", "Pockets that came to the work without a bottle.").of("missing"),
                count(f"{name}/skipped", "counter", "Bottles that left without complete work. They are bad.").of(
                    "skipped"
                ),
                count(f"{name}/lost", "counter", "Bottles that left their pocket during the work.").of("lost"),
                switch(f"{name}/on", "command", "Tools begin work while on.", initial=1.0),
                count(
                    f"{name}/dead_tool",
                    "fault",
                    "Number of the pocket whose tool does not work, from 1; 0 for none.",
                    high=star.pockets,
                ),
            ],
        )
        self.work_as(name, part, setup)
        self._ends = part.from_, part.to
        self._pockets, self._pitch = star.pockets, 2.0 * math.pi / star.pockets
        self.missing = self.skipped = self.lost = 0
        self.on = True
        self.dead_tool = 0
        self.bottles, self.done, self.left_out = ([NONE] * star.pockets for _ in range(3))
        self.turned = self._star.angle
        """Angle by which the wheel has turned, rad, with all of its turns."""
        self.passed = [self._passed(angle) for angle in self._ends]
        """Number of pockets that have passed each of the two angles, less those that have passed it backward."""

    def _passed(self, angle: float) -> int:
        """Return the number of pockets that have passed an angle (rad).

        Pocket k passes it when the wheel has turned by `angle` + k pitches.
        """
        return math.floor((self.turned - angle) / self._pitch)

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Take `on` or the fault `dead_tool`."""
        if name.endswith("/on"):
            self.on = value != 0.0
        else:
            self.dead_tool = int(value)

    def feed(self, now: ScanContext) -> None:
        """Begin and end the work on bottles in the pockets that have passed an angle. The ledger books it as fed."""
        turned = self._star.angle
        self.turned += math.remainder(turned - self.turned, 2.0 * math.pi)
        for end, angle in enumerate(self._ends):
            before, self.passed[end] = self.passed[end], self._passed(angle)
            for passed in range(before + 1, self.passed[end] + 1):
                (self._begin if end == 0 else self._end)(passed % self._pockets, turned, now)

    def _begin(self, pocket: int, turned: float, now: ScanContext) -> None:
        bottle = self._bottle(self._slot(pocket, turned, now), now)
        works = self.on and pocket != self.dead_tool - 1 and bottle != self.done[pocket]
        self.missing += bottle == NONE
        self.bottles[pocket] = bottle if works or bottle == NONE else IDLE

    def _end(self, pocket: int, turned: float, now: ScanContext) -> None:
        slot, begun = self._slot(pocket, turned, now), self.bottles[pocket]
        bottle = self._bottle(slot, now)
        self.bottles[pocket] = NONE
        self.lost += begun >= 0 and bottle != begun
        if bottle in (NONE, self.done[pocket]):
            return
        if bottle != begun:
            self.skipped += bottle != self.left_out[pocket]
            self.left_out[pocket] = bottle
            now.set_attribute(bottle, BAD, 1.0)
            return
        before = int(now.state.world.bottles.type[slot])
        if (after := self.type_after(before)) != before:
            now.state.change_type(slot, after)
        self.done[pocket] = bottle
        self.finish(bottle, now)

    def _bottle(self, slot: int, now: ScanContext) -> int:
        return int(now.state.world.bottles.id[slot]) if slot >= 0 else NONE

    def _slot(self, pocket: int, turned: float, now: ScanContext) -> int:
        """Return the slot of the bottle in a pocket, -1 if it is empty."""
        x, y = self._wheel.pocket(pocket, turned)
        bottles, reach = now.state.world.bottles, WITHIN * self._wheel.part.pocket_radius
        near = np.flatnonzero(abs(bottles.x - x) <= reach)
        near = near[(abs(bottles.y[near] - y) <= reach) & (bottles.id[near] >= 0)]
        if not near.size:
            return -1
        apart = np.hypot(bottles.x[near] - x, bottles.y[near] - y)
        nearest = int(apart.argmin())
        return int(near[nearest]) if apart[nearest] <= reach else -1

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the values in the order of the signals."""
        held = self._pockets - self.bottles.count(NONE) - self.bottles.count(IDLE)
        return self.processed, *self.work_values(), held
