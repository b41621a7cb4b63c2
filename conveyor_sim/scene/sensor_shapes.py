"""Where the sensors of a scene are, for drawings."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.scene.parts.inspection import Inspection
from conveyor_sim.scene.schema import Scene


@dataclass(frozen=True)
class SensorShape:
    """The line of a beam, a counter or an inspection, or the corners of a zone: `points` (k, 2) in m."""

    kind: Literal["photo_eye", "zone", "counter", "inspection"]
    name: str
    points: NDArray[np.float64]


def sensor_shapes(scene: Scene) -> list[SensorShape]:
    """Photo-eyes, zones, counters and inspections, in listing order."""
    return [
        *(SensorShape("photo_eye", name, np.array([eye.from_, eye.to])) for name, eye in scene.photo_eyes.items()),
        *(SensorShape("zone", name, np.array(zone.region)) for name, zone in scene.zones.items()),
        *(SensorShape("counter", name, np.array([line.from_, line.to])) for name, line in scene.counters.items()),
        *(
            SensorShape("inspection", name, np.array([machine.from_, machine.to]))
            for name, machine in scene.machines.items()
            if isinstance(machine, Inspection)
        ),
    ]
