# SPDX-License-Identifier: Apache-2.0
"""Speeds and positions of the axes of a scene at the start, their limits, and the belts that they move."""

import math

from conveyor_sim.scene.belts import Belt, CurvedBelt
from conveyor_sim.scene.parts.axis import CYCLE, Axis
from conveyor_sim.scene.schema import Scene


def first_speed(scene: Scene, name: str) -> float:
    """Return the speed of an axis at the start, rad/s; out of gear 0."""
    axis = scene.axes[name]
    if axis.rate is not None:
        return CYCLE * axis.rate
    if axis.drive is not None and axis.travel is not None:
        return CYCLE * scene.drives[axis.drive].speed / axis.travel
    if axis.master is not None and axis.in_gear:
        return axis.ratio * first_speed(scene, axis.master)
    return 0.0


def slaves_of(scene: Scene, name: str) -> list[str]:
    """Return the names of the axes that follow an axis, directly or through others."""
    direct = [other for other, axis in scene.axes.items() if axis.master == name]
    return [slave for other in direct for slave in (other, *slaves_of(scene, other))]


def rated_speed(scene: Scene, name: str) -> float:
    """Return the largest speed of an axis in gear, rad/s, with the sign of its ratio."""
    axis = scene.axes[name]
    if axis.master is not None:
        return axis.ratio * rated_speed(scene, axis.master)
    return _own_top_speed(scene, axis)


def first_position(scene: Scene, name: str) -> float:
    """Return the position of an axis at the start, rad: its phase, in gear with masters at theirs."""
    axis = scene.axes[name]
    return 0.0 if axis.master is None else axis.ratio * first_position(scene, axis.master) + axis.phase


def top_speed(scene: Scene, name: str) -> float:
    """Return the largest speed of an axis by commands, rad/s, forward or backward."""
    axis = scene.axes[name]
    if axis.master is not None:
        return abs(axis.ratio) * top_speed(scene, axis.master) + axis.jog_speed
    return max(_own_top_speed(scene, axis), axis.jog_speed)


def _own_top_speed(scene: Scene, axis: Axis) -> float:
    """Return the largest speed of an axis without a master by its rate, drive or machine, rad/s."""
    if axis.rate is not None:
        return CYCLE * axis.top_rate
    if axis.drive is not None and axis.travel is not None:
        return CYCLE * max(map(abs, scene.drives[axis.drive].speed_limits)) / axis.travel
    return CYCLE * _machine_rate(scene, axis)


def _machine_rate(scene: Scene, axis: Axis) -> float:
    machine = scene.machines.get(axis.machine or "")
    rates = (getattr(machine, "rate", None), getattr(machine, "rate_limit", None))
    return max((float(rate) for rate in rates if rate is not None), default=0.0)


def travel_per_radian(belt: Belt) -> float:
    """Return the travel of a belt that an axis moves, m/rad of the axis, along its centre line."""
    if isinstance(belt, CurvedBelt) and belt.travel is None:
        return belt.ratio * belt.middle_radius
    return (belt.travel or 0.0) / (2.0 * math.pi)
