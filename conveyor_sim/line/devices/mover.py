# SPDX-License-Identifier: Apache-2.0
"""Gates, pushers, diverters and clamps: rails that move to and fro on command, with end switches.

A motion profile is an array (PHASES, 4): start time (s), position, speed and acceleration of each phase.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from conveyor_sim.engine.arrays.moving import HELD, OFF_PROFILE, ON_PROFILE, PHASES, MovingBodies
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.rails.motion_profile import plan_profile
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import Tag, number, switch
from conveyor_sim.scene.parts.movers import Mover as MoverPart

WORDS = {
    "gates": ("open", "is_closed", "is_open", "closed", "open"),
    "pushers": ("push", "retracted", "extended", "retracted", "extended"),
    "diverters": ("divert", "at_home", "diverting", "at home", "diverting"),
    "clamps": ("close", "is_open", "is_closed", "open", "closed"),
}
"""By kind: the command, the end switches at home and at the end of the stroke, and the words for these positions."""

SWITCHED = 1e-3
"""Share of the stroke within which an end switch is on, and within which a mover off its motion profile is not
blocked."""


class Mover(Device):
    """Moving rail: to the end of its stroke while its command is on, home while it is off.

    A jammed mover stands still, and continues when it is free again. Where bottles are too heavy for its drive, it is
    held up or pushed back, and continues from there.
    """

    def __init__(self, name: str, part: MoverPart, setup: DeviceSetup) -> None:
        axes = setup.model.plant.axes
        index = [axis.name for axis in axes].index(name)
        shape = axes[index]
        self._number, self._shape, self._part = index, shape, part
        super().__init__(name, self.own_tags(name, shape.first / shape.stroke))
        self.target = self.position = shape.first
        """Target position, m or rad."""
        self.speed = 0.0
        self.jammed = False
        self.course = resting(shape.first)
        self.since = 0
        """Tick at which the motion profile began."""
        self.limited = False
        """True if the drive could not follow the motion profile throughout the last tick."""
        self.blocked = False
        """True from when the drive can't stay near the motion profile, until it has followed it for one tick."""

    def own_tags(self, name: str, share: float) -> Sequence[Tag]:
        """Return the tags. share: initial part of the stroke."""
        order, home, away, at_home, at_end = WORDS[name.split("/")[0]]
        text = f"On: moves until {at_end}. Off: moves until {at_home}."
        return (
            number(f"{name}/position", "actual", f"From 0, {at_home}, to 1, {at_end}.", "1", 0.0, 1.0, share),
            switch(f"{name}/{home}", "status", f"It is {at_home}.", float(share <= SWITCHED)),
            switch(f"{name}/{away}", "status", f"It is {at_end}.", float(share >= 1.0 - SWITCHED)),
            switch(f"{name}/blocked", "status", "Bottles hold it up, or have pushed it away.", adds_to="state"),
            switch(f"{name}/{order}", "command", text, round(share)),
            switch(f"{name}/jammed", "fault", "Stands still, against any load."),
        )

    def target_of(self, value: float) -> float:
        """Return the position (m or rad) that a value of the command stands for."""
        return self._shape.stroke if value != 0.0 else 0.0

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Move to the other end, jam, or become free, from the present position."""
        if name == self.faults[0].name:
            self.jammed = value != 0.0
        elif self._stands and self.target == self.target_of(value):
            self.since = now.tick  # as `plan`, which would wake it in every tick of a repeated command
            return
        else:
            self.target = self.target_of(value)
        self.plan(now)

    def plan(self, now: ScanContext) -> None:
        """Start the motion profile from the present position and speed to the target, or rest if jammed."""
        self._stands = False
        self.wake()
        self.since = now.tick
        if self.jammed:
            self.course = resting(self.position)
        else:
            shape = self._shape
            speed = self.speed
            self.course = profile_to(self.position, speed, self.target, shape.max_speed, shape.acceleration)

    @property
    def axis(self) -> int:
        """Index of its axis."""
        return self._number

    _stands = False
    """True if it rests since the end of the last tick."""

    def restored(self, tick: int) -> None:
        """Wait for the end of a tick before it rests."""
        self._stands = False

    def rests(self, now: ScanContext) -> bool:
        """Return True if it stands at its target, and no bottle is near that its drive could be too weak for."""
        self._stands = self._may_rest(now)
        return self._stands

    def _may_rest(self, now: ScanContext) -> bool:
        rails, number = self._rails(now), self._number
        if self.jammed or self.limited or self.blocked or self.position != self.target or self.speed != 0.0:
            return False
        if (actuators := rails.actuators) is not None and (
            actuators.mode[number] != ON_PROFILE or actuators.left[number] or rails.loaded[number]
        ):
            return False
        self.course = resting(self.position)
        rails.course[number] = self.course
        return True

    @property
    def is_home(self) -> bool:
        """True if it is at home, and stays there."""
        return self.target == 0.0 and self.position <= SWITCHED * self._shape.stroke

    def begin(self, now: ScanContext) -> None:
        """Set the motion profile of this tick in the engine."""
        rails, number = self._rails(now), self._number
        rails.course[number] = later(self.course, (now.tick - self.since) * now.length)
        if (actuators := rails.actuators) is not None:
            actuators.left[number] = 0
            if self.jammed:
                actuators.mode[number] = HELD
            elif actuators.mode[number] == HELD:
                actuators.mode[number] = ON_PROFILE

    def end(self, now: ScanContext) -> None:
        """Take over the position, and a changed motion profile if the drive was held up."""
        rails, number = self._rails(now), self._number
        self.position, self.speed = float(rails.position[number]), float(rails.speed[number])
        if (actuators := rails.actuators) is None:
            return
        self.limited = bool(actuators.left[number])
        if self.limited:
            self.course, self.since = rails.course[number].copy(), now.tick - 1
        away = abs(self.position - position_at(self.course, (now.tick - self.since) * now.length))
        held_up = bool(actuators.mode[number] == OFF_PROFILE) and away > SWITCHED * self._shape.stroke
        self.blocked = held_up or (self.blocked and self.limited)

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the position from 0, at home, to 1, both end switches, and blocked."""
        share = min(1.0, max(0.0, self.position / self._shape.stroke))
        return share, float(share <= SWITCHED), float(share >= 1.0 - SWITCHED), float(self.blocked)

    def states(self, now: ScanContext) -> list[float]:
        """Return blocked."""
        return [self.blocked]

    def _rails(self, now: ScanContext) -> MovingBodies:
        moving = now.state.world.moving
        assert moving is not None
        return moving


_plan: Any = plan_profile.py_func  # type: ignore[attr-defined]


def resting(position: float) -> F8:
    """Return the motion profile of permanent rest at a position."""
    profile = np.zeros((PHASES, 4))
    profile[:, 1] = position
    return profile


def profile_to(position: float, speed: float, target: float, max_speed: float, acceleration: float) -> F8:
    """Return the fastest motion profile from a position and speed to rest at the target; it may turn round first.

    Units are m and s, or rad and s. Times count from now.
    """
    profile = np.zeros((1, PHASES, 4))
    _plan(profile, 0, 0.0, position, speed, target, max_speed, acceleration)
    return np.asarray(profile[0])


def position_at(profile: F8, seconds: float) -> float:
    """Return the position on a motion profile `seconds` after its start."""
    k = max(0, int(profile[:, 0].searchsorted(seconds, side="right")) - 1)
    start, position, speed, acceleration = profile[k].tolist()
    since = seconds - start
    return float(position + (speed + 0.5 * acceleration * since) * since)


def later(profile: F8, seconds: float) -> F8:
    """Return the motion profile with times counted from `seconds` later."""
    shifted = profile.copy()
    shifted[:, 0] -= seconds
    return shifted
