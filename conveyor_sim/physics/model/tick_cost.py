# SPDX-License-Identifier: Apache-2.0
"""Estimated computing time of a tick on one core of the 2020s: its steps, and the line beside them.

The constants are rounded fits to the CPU time of the shipped scenes without controller; `check` prints the result and
docs/performance.md compares it with measurements. `explain --price` measures what this model estimates.
"""

from dataclasses import dataclass

from conveyor_sim.scene.moving import bodies_of
from conveyor_sim.scene.schema import Scene

BOTTLE_STEP = 2.3e-8
"""s per bottle and step."""

BESIDE = 10
"""Fixed cost of a step, independent of the number of bottles, in units of the cost of one bottle."""

AT_BODY = 3
"""Additional cost of a step for a bottle at a moving body, in units of the cost of one bottle."""

TICK_COST = 2e-5
"""s per tick besides its steps: commands and the guard."""

BOTTLE_TICK = 5e-7
"""s per bottle and tick besides the steps."""

DEVICE_TICK = 4e-6
"""s per device or belt and tick."""

AXIS_TICK = 3e-5
"""s per axis and tick."""


@dataclass(frozen=True)
class LineSize:
    """Numbers of the parts of a line that take computing time."""

    places: int = 0
    """Places of bottles at moving bodies: pockets, threads, gates."""
    devices: int = 0
    """Devices and belts, axes included."""
    axes: int = 0


def line_size(scene: Scene) -> LineSize:
    """Return the size of the line of a valid scene."""
    places = sum(len(body.groups) for body in bodies_of(scene))
    return LineSize(places, len([*scene.devices()]) + len(scene.belts), len(scene.axes))


def tick_seconds(work: float, bottles: int, line: LineSize) -> float:
    """Return the estimated computing time (s) of a tick on one core. work: its steps times their relative cost."""
    step = (bottles + BESIDE + AT_BODY * min(bottles, line.places)) * BOTTLE_STEP
    beside = TICK_COST + bottles * BOTTLE_TICK + line.devices * DEVICE_TICK + line.axes * AXIS_TICK
    return beside + work * step
