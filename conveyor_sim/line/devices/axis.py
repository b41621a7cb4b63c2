# SPDX-License-Identifier: Apache-2.0
"""Axes: speed control, gears, phase shifts and jogging, with the terms of PLCopen motion control.

A commanded motion is a closed form within each tick (`axis_motion.py`). Axes in gear follow the commanded motion of
their master. The drive of an axis holds it on the commanded motion up to its torque limit; beyond, a following error
grows, which the drive takes up again at jog speed when it can.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np

from conveyor_sim.engine.arrays.moving import HELD, ON_PROFILE
from conveyor_sim.line.alarms.declaration import Declared, error
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.axis_motion import Motion, Shift, acceleration_toward, write_profile
from conveyor_sim.line.devices.drive import NamedDriveDevice
from conveyor_sim.line.devices.edge import RisingEdge
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import Tag, number, switch
from conveyor_sim.scene.driven import moved_by_axis
from conveyor_sim.scene.gearing import first_position, first_speed, slaves_of, top_speed, travel_per_radian
from conveyor_sim.scene.parts.axis import CYCLE, Axis

FREE, SYNCHRONISING, GEARED = range(3)
"""Modes: moving by itself; approaching the speed of the master; at its speed, and in phase except for shifts."""

ROUNDING = 1e-12
"""Phase errors below this are rounding, rad."""

LARGEST_TORQUE = 1e6
"""Range of the torque signal of drives without limit, N m."""


class CarriedMachine(Protocol):
    """Machine on the shaft of an axis."""

    jammed: bool
    """True while it blocks the axis."""


class AxisDevice(Device):
    """Axis of a running line. It is enabled at the start, at the speed of the scene.

    Without power, axes brake and stay in gear. After an emergency stop, a rising edge of `enable` or `gear_in` starts
    them.
    """

    def __init__(self, name: str, part: Axis, setup: DeviceSetup) -> None:
        """Build the tags, and find the axis and its belts by name."""
        scene, short_name = setup.scene, name.rpartition("/")[2]
        top, first = top_speed(scene, short_name), first_position(scene, short_name)
        start = first_speed(scene, short_name)
        self._part, self._setup, self._tick, self._short_name = part, setup, scene.tick, short_name
        self._top, self._spacing = top, part.gear_spacing
        self._has_own_rate = part.drive is None and part.machine is None
        self._modulus = CYCLE if part.cam is None else part.cam[-1][0]
        super().__init__(name, [*self._drive_tags(name, first, start), *(self._gear_tags(name) if part.master else ())])
        self._number = [axis.name for axis in setup.model.plant.axes].index(name)
        belts = moved_by_axis(scene, short_name)
        self._belts = np.array([setup.speed_index(f"belts/{belt}") for belt in belts], dtype=np.int64)
        self._moves_belts = bool(belts)
        self._travels = np.array([travel_per_radian(scene.belts[belt]) for belt in belts])
        self._torque_alarm, self._fault_alarm = f"{name}/torque", f"{name}/fault"
        self._power = setup.power("drives", self)
        self._master: AxisDevice | None = None
        self._machines: list[CarriedMachine] = []
        self._motion = Motion(first, start)
        self._planned = -1
        self.mode = GEARED if part.master is not None and part.in_gear else FREE
        self.position, self.speed = first, start
        """Commanded position (rad) and speed (rad/s) at the end of the last tick."""
        self.actual_position, self.actual_speed = first, start
        self.torque = 0.0
        """Mean torque that the drive exerts on bottles in the last tick, N m."""
        self.following_error = 0.0
        """Commanded minus actual position, rad."""
        self.offset = first - part.ratio * (first_position(scene, part.master) if part.master else 0.0)
        """Position in gear and in phase while the master is at 0, rad."""
        self.shift, self.catch_up = Shift(), Shift()
        self.phase_shift = 0.0
        self.rate = part.rate or 0.0
        self.enable, self.gear_in, self.gear_out, self.reset = (
            RisingEdge(True),
            RisingEdge(),
            RisingEdge(),
            RisingEdge(),
        )
        self.jog_forward = self.jog_backward = False
        self.jammed = self.tripped = self.limited = False
        self.follows = part.drive is not None
        """True while it keeps up with the speed of a named drive."""
        self.restored(0)

    def _drive_tags(self, name: str, first: float, start: float) -> Iterator[Tag]:
        part, top, most = self._part, self._top, self._most_torque
        place = "Position." if part.cam is None else "Position, the input of its cam."
        yield number(f"{name}/position", "actual", place, "rad", 0.0, self._modulus, first % self._modulus)
        yield number(f"{name}/speed", "actual", "Speed.", "rad/s", -top, top, start)
        text = "Torque that it exerts on bottles, forward positive, up to its limit."
        yield number(f"{name}/torque", "actual", text, "N m", -most, most)
        text = "Commanded minus actual position, up to a cycle."
        yield number(f"{name}/following_error", "actual", text, "rad", -CYCLE, CYCLE)
        yield switch(f"{name}/running", "status", "Enabled, with power, and not failed.", 1.0, "state")
        yield switch(f"{name}/torque_limited", "status", "Its load exceeds its torque limit.", adds_to="state")
        yield switch(f"{name}/fault", "status", "Failed by its following error.", adds_to="state")
        yield switch(f"{name}/enable", "command", "Off: brakes, and leaves the gear.", 1.0)
        yield switch(f"{name}/reset", "command", "Its rising edge resets a fault whose cause is gone.")
        yield switch(f"{name}/jog_forward", "command", "Out of gear: moves forward at jog speed while on.")
        yield switch(f"{name}/jog_backward", "command", "Out of gear: moves backward at jog speed while on.")
        if self._has_own_rate:
            most_rate = part.top_rate if part.master is None else top / CYCLE
            yield number(
                f"{name}/rate",
                "setpoint",
                "Cycles per second out of gear, positive forward.",
                "1/s",
                -most_rate,
                most_rate,
                part.rate or 0.0,
                nominal=most_rate,
            )
        yield switch(f"{name}/jammed", "fault", "Stands still, against any torque of its drive.")

    def _gear_tags(self, name: str) -> Iterator[Tag]:
        geared = float(self._part.in_gear)
        yield switch(f"{name}/in_gear", "status", "In gear, in phase, without following error.", geared, "state")
        yield number(f"{name}/phase_error", "actual", "Deviation from the phase in gear.", "rad", -CYCLE, CYCLE)
        yield switch(f"{name}/gear_in", "command", "Its rising edge gears an enabled axis in: speed first, then phase.")
        yield switch(f"{name}/gear_out", "command", "Its rising edge gears out: goes on at its own rate.")
        yield number(f"{name}/phase_shift", "setpoint", "Shift of the phase from the scene's.", "rad", -CYCLE, CYCLE)

    @property
    def alarms(self) -> Sequence[Declared]:
        """Alarms of the torque limit and of the following error.

        The failure of an axis stops its masters, whose alarms it suppresses as consequences.
        """
        name, causes = self.name, [f"axes/{slave}/fault" for slave in slaves_of(self._setup.scene, self._short_name)]
        torque = error(self._torque_alarm, f"{name} has reached its torque limit", f"{name}/torque_limited", causes)
        text = f"{name} has failed: its following error is too large"
        fault = error(self._fault_alarm, text, f"{name}/fault", causes)
        return (torque, fault) if self._part.torque_limit != "none" else (fault,)

    @property
    def _most_torque(self) -> float:
        return LARGEST_TORQUE if self._part.torque_limit == "none" else self._part.torque_limit

    @property
    def speed_range(self) -> tuple[float, float, float]:
        """Least and greatest speed, and that at the start, rad/s."""
        speed = next(tag for tag in self.signals if tag.name.endswith("/speed"))
        return speed.low, speed.high, speed.initial

    @property
    def runs(self) -> bool:
        """True if it is enabled, has power, and has not failed."""
        return self.enable.on and not self.tripped and not self._is_locked

    @property
    def is_geared(self) -> bool:
        """True if it is in gear, in phase, without following error."""
        return self.mode == GEARED and self._phase_error == 0.0 and self.following_error == 0.0

    @property
    def phase_error(self) -> float:
        """Commanded position minus position in phase, rad; 0 out of gear."""
        return self._phase_error

    def add_machine(self, machine: "CarriedMachine") -> None:
        """Add a machine that it turns, whose jam blocks it."""
        self._machines.append(machine)

    @property
    def _is_jammed(self) -> bool:
        if self.jammed:
            return True
        for machine in self._machines:  # noqa: SIM110 - a generator takes three times as long, four times per tick
            if machine.jammed:
                return True
        return False

    @property
    def _is_locked(self) -> bool:
        return self._power is not None and self._power.holds(self.name)

    @property
    def master(self) -> "AxisDevice | None":
        """Its master; None without one."""
        if self._master is None and self._part.master is not None:
            self._master = self._setup.device(AxisDevice, f"axes/{self._part.master}")
        return self._master

    def restored(self, tick: int) -> None:
        """Forget the motion of a tick before."""
        self._planned = -1
        self._phase_error = 0.0
        if self.mode == GEARED and (motion := self.shift.during(tick, self._tick)) is not None:
            self._phase_error = motion.position

    def objection(self, name: str, value: float, now: ScanContext) -> str:
        """Return why a command can't be taken now: an axis in gear does not jog."""
        if value and self.mode != FREE and name.rpartition("/")[2].startswith("jog_"):
            return f"{name}: {value:g} given in gear, expected {self.name}/gear_out before"
        return ""

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Apply a setpoint (1/s, rad), a switch, a rising edge, or the fault `jammed`."""
        what, on = name.rpartition("/")[2], value != 0.0
        if what in ("rate", "phase_shift"):
            setattr(self, what, value)
        elif what in ("jog_forward", "jog_backward", "jammed"):
            setattr(self, what, on)
        elif what == "enable":
            if self.enable.rises(value):
                self._start()
            if not on and self.mode != FREE:
                self._leave_gear()
        elif what == "gear_in":
            if self.gear_in.rises(value) and self.mode == FREE and self.enable.on and not self.tripped:
                self._start()
                self.mode, self.jog_forward, self.jog_backward = SYNCHRONISING, False, False
        elif what == "gear_out":
            if self.gear_out.rises(value) and self.mode != FREE:
                self._leave_gear()
        elif self.reset.rises(value) and self.tripped and not self._is_jammed:
            self.tripped = False
            now.alarm(self._fault_alarm, False)

    def _start(self) -> None:
        if self._power is not None:
            for axis in (self, *self._train()):
                self._power.start(axis.name)

    def _leave_gear(self) -> None:
        self.mode = FREE
        self.shift.stop()
        self._phase_error = 0.0

    def wanted(self, now: ScanContext) -> float:
        """Return the speed that it is commanded to have out of gear, or that of its gear, rad/s."""
        if self.mode != FREE and self.master is not None:
            return self._part.ratio * self.master.wanted(now)
        if not self._may_run:
            return 0.0
        if self.jog_forward != self.jog_backward:
            return self._part.jog_speed if self.jog_forward else -self._part.jog_speed
        return self._source_speed(now)

    @property
    def _may_run(self) -> bool:
        """True if it runs, and no axis that is in gear with it has failed."""
        return self.runs and not self._carries_failed

    @property
    def _carries_failed(self) -> bool:
        """True if an axis that is in gear with this one, directly or not, has failed."""
        for axis in self._slaves():  # noqa: SIM110 - as in `_is_jammed`
            if axis.mode != FREE and (axis.tripped or axis._carries_failed):
                return True
        return False

    def _source_speed(self, now: ScanContext) -> float:
        part = self._part
        if part.drive is not None and part.travel is not None:
            return CYCLE * self._setup.device(NamedDriveDevice, f"drives/{part.drive}").speed(now) / part.travel
        if part.machine is not None:
            return CYCLE * self._setup.devices[f"machines/{part.machine}"].cycle_rate
        return CYCLE * self.rate

    def _train(self) -> Iterator["AxisDevice"]:
        """Yield the axes that are in gear with this one, directly or not."""
        for axis in self._slaves():
            if axis.mode != FREE:
                yield axis
                yield from axis._train()

    def _slaves(self) -> list["AxisDevice"]:
        if self._followers is None:
            axes = (device for device in self._setup.devices.values() if isinstance(device, AxisDevice))
            self._followers = [axis for axis in axes if axis.master is self]
        return self._followers

    _followers: "list[AxisDevice] | None" = None

    _in_phase: tuple[float, float] | None = None
    """Offset and phase shift that agree, unless a shift has begun since."""

    def plan(self, now: ScanContext) -> Motion:
        """Return the commanded motion in the tick that begins, and set the commands at its end."""
        if self._planned != now.tick:
            self._planned = now.tick
            self._motion = self._by_itself(now) if self.mode != GEARED else self._in_gear(now)
        return self._motion

    def _by_itself(self, now: ScanContext) -> Motion:
        """Return a motion towards the own speed, or towards that of the master."""
        part, tick, master = self._part, self._tick, self.master
        if self.mode == SYNCHRONISING and master is not None:
            master.plan(now)
            target = part.ratio * master.speed
        else:
            target = self.wanted(now)
        if target == self.speed and self.mode == FREE:
            motion = Motion(self.position, self.speed)
            if self.speed != 0.0:
                self.position, self.follows = motion.after(tick)[0], part.drive is not None
            return motion
        # A drive has a ramp itself. Once an axis has its speed, it keeps up.
        limit = math.inf if self.follows and self.runs else part.acceleration
        if self.mode == FREE and not self._may_run and part.stop_deceleration is not None:
            limit = part.stop_deceleration
        acceleration = acceleration_toward(self.speed, target, limit, tick)
        motion = Motion(self.position, self.speed, acceleration)
        reached = abs(target - self.speed) <= limit * tick
        self.position, speed = motion.after(tick)
        self.speed = target if reached else speed
        self.follows = reached and part.drive is not None and self.runs
        if reached and self.mode == SYNCHRONISING and master is not None:
            self._take_up_phase(self.position - part.ratio * master.position, now.tick + 1)
        return motion

    def _take_up_phase(self, offset: float, at: int) -> None:
        """Enter the gear with an offset, and shift from it to the nearest one in phase, from tick `at` on."""
        nearest = round((offset - self._goal) / self._spacing)
        self.mode, self.offset = GEARED, self._goal + nearest * self._spacing
        self._begin_shift(at, self.offset - offset)

    def _begin_shift(self, at: int, distance: float) -> None:
        self._phase_error = 0.0
        if abs(distance) > ROUNDING:
            self.shift.start(at, distance, self._part.jog_speed, self._part.acceleration, self._tick)
            self._phase_error = -distance

    @property
    def _goal(self) -> float:
        return self._part.phase + self.phase_shift

    def _in_gear(self, now: ScanContext) -> Motion:
        """Return the motion of the master times the ratio, and a shift of the phase that goes on."""
        part, tick, master = self._part, self._tick, self.master
        assert master is not None
        if self.shift.distance == 0.0 and self._in_phase != (phase := (self.offset, self.phase_shift)):
            self._in_phase = phase
            turns = round((self.offset - self._goal) / self._spacing)
            if abs(change := self._goal + turns * self._spacing - self.offset) > ROUNDING:
                self.offset += change
                self._begin_shift(now.tick, change)
        ratio, offset = part.ratio, self.offset
        motion = master.plan(now).geared(ratio, offset)
        self.position, self.speed = ratio * master.position + offset, ratio * master.speed
        shift = self.shift.during(now.tick, tick) if self.shift.distance else None
        self._phase_error = 0.0
        if shift is not None:
            motion = motion.plus(shift)
            after = self.shift.during(now.tick + 1, tick)
            if after is not None:
                self.position, self.speed = self.position + after.position, self.speed + after.speed
                self._phase_error = after.position
        return motion

    def begin(self, now: ScanContext) -> None:
        """Set the motion profile of this tick in the engine, and the speeds of its belts."""
        motion, jammed = self.plan(now), self._is_jammed
        if jammed or self.following_error != 0.0:
            motion = self._of_shaft(motion, now)
        after = self.actual_position, self.actual_speed = motion.after(self._tick)
        moving, number = now.state.world.moving, self._number
        if moving is not None:
            write_profile(moving.course, number, motion, after, self._tick)
            if (actuators := moving.actuators) is not None:
                actuators.left[number] = 0
                if jammed:
                    actuators.mode[number] = HELD
                elif actuators.mode.item(number) == HELD:
                    actuators.mode[number] = ON_PROFILE
        if self._moves_belts:
            now.setpoints[self._belts] = self._travels * self.wanted(now)
            now.speeds[self._belts] = self._travels * ((self.actual_position - motion.position) / self._tick)

    def _of_shaft(self, motion: Motion, now: ScanContext) -> Motion:
        """Return the motion of the shaft: at rest if jammed, else with its following error, which it catches up."""
        part, tick = self._part, self._tick
        if self._is_jammed:
            self.catch_up.stop()
            self.following_error = self.position - self.actual_position
            return Motion(self.actual_position, 0.0)
        if self.catch_up.distance == 0.0:
            if self.limited or not self.runs:
                return motion.plus(Motion(-self.following_error, 0.0))
            self.catch_up.start(now.tick, self.following_error, part.jog_speed, part.acceleration, tick)
        gain = self.catch_up.during(now.tick, tick)
        after = self.catch_up.during(now.tick + 1, tick)
        self.following_error = 0.0 if after is None else -after.position
        return motion if gain is None else motion.plus(gain)

    def end(self, now: ScanContext) -> None:
        """Take over position and torque of a limited drive, and fail if the following error is too large."""
        moving, number = now.state.world.moving, self._number
        if now.tick and moving is not None and (actuators := moving.actuators) is not None:
            self.torque = 0.0 - actuators.load.item(number) / moving.clock.item(0)  # not -0
            limited = bool(actuators.left.item(number)) and not self._is_jammed
            if limited:
                self.catch_up.stop()
                self.actual_position, self.actual_speed = float(moving.position[number]), float(moving.speed[number])
                self.following_error = self.position - self.actual_position
            if limited != self.limited:
                self.limited = limited
                now.alarm(self._torque_alarm, limited)
        limit = self._part.following_limit
        beyond = self.following_error != 0.0 and limit != "none" and abs(self.following_error) > limit
        if beyond and not self.tripped and (self.limited or self._is_jammed):
            self.tripped = True
            now.alarm(self._fault_alarm, True)

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the signals in their order."""
        values = (
            self.actual_position % self._modulus,
            self.actual_speed,
            _within(self.torque, self._most_torque),
            _within(self.following_error, CYCLE),
            self.runs,
            self.limited,
            self.tripped,
        )
        return values if self._part.master is None else (*values, self.is_geared, self._phase_error)

    def states(self, now: ScanContext) -> list[float]:
        """Return running, torque_limited, fault, and in_gear of an axis with a master."""
        geared = () if self._part.master is None else (self.is_geared,)
        return [self.runs, self.limited, self.tripped, *geared]


def _within(value: float, most: float) -> float:
    """Return a value limited to the range of its signal, from -most to most."""
    return min(max(value, -most), most)
