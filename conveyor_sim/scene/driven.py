# SPDX-License-Identifier: Apache-2.0
"""Speeds of belts, some of which are moved by named drives or axes."""

from conveyor_sim.scene.gearing import first_speed, top_speed, travel_per_radian
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.schema import Scene


def belt_speeds(scene: Scene) -> dict[str, float]:
    """Return the speed of each belt at the start, m/s, by name, in the scene's order."""
    return {name: _first_speed(scene, name) for name in scene.belts}


def _first_speed(scene: Scene, name: str) -> float:
    belt = scene.belts[name]
    if belt.axis is not None:
        return travel_per_radian(belt) * first_speed(scene, belt.axis)
    return belt.speed if belt.drive_name is None else belt.ratio * scene.drives[belt.drive_name].speed


def speed_limits(scene: Scene, belt: str) -> tuple[float, float]:
    """Return the least and greatest speed of a belt, m/s."""
    part = scene.belts[belt]
    if part.axis is not None:
        fastest = travel_per_radian(part) * top_speed(scene, part.axis)
        return -fastest, fastest
    if part.drive_name is None:
        return part.speed_limits
    least, greatest = scene.drives[part.drive_name].speed_limits
    return part.ratio * least, part.ratio * greatest


def driven_by(scene: Scene, drive: str) -> list[str]:
    """Return the belts that name a drive, in the scene's order."""
    return [name for name, belt in scene.belts.items() if belt.drive_name == drive]


def moved_by_axis(scene: Scene, axis: str) -> list[str]:
    """Return the belts that an axis moves, in the scene's order."""
    return [name for name, belt in scene.belts.items() if belt.axis == axis]


def speed_owner(scene: Scene, belt: str) -> Path:
    """Return the path of the part that has the speed and its limits: the belt, or the drive or axis that moves it."""
    part = scene.belts[belt]
    if part.axis is not None:
        return ("axes", part.axis)
    return ("belts", belt) if part.drive_name is None else ("drives", part.drive_name)
