# SPDX-License-Identifier: Apache-2.0
"""Speeds of belts, some of which are moved by named drives."""

from conveyor_sim.scene.schema import Scene


def belt_speeds(scene: Scene) -> dict[str, float]:
    """Return the speed of each belt at the start, m/s, by name, in the scene's order."""
    return {
        name: belt.speed if belt.drive_name is None else belt.ratio * scene.drives[belt.drive_name].speed
        for name, belt in scene.belts.items()
    }


def speed_limits(scene: Scene, belt: str) -> tuple[float, float]:
    """Return the least and greatest speed of a belt, m/s."""
    part = scene.belts[belt]
    if part.drive_name is None:
        return part.speed_limits
    least, greatest = scene.drives[part.drive_name].speed_limits
    return part.ratio * least, part.ratio * greatest


def driven_by(scene: Scene, drive: str) -> list[str]:
    """Return the belts that name a drive, in the scene's order."""
    return [name for name, belt in scene.belts.items() if belt.drive_name == drive]
