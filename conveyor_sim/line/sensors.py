"""The sensors of a line and the indicators that rest on them, in the order in which they look."""

from collections.abc import Callable, Sequence

import numpy as np

from conveyor_sim.line.belt import BeltDevice
from conveyor_sim.line.counter import CounterDevice
from conveyor_sim.line.device import Device
from conveyor_sim.line.indicator import IndicatorDevice
from conveyor_sim.line.photo_eye import photo_eye_devices
from conveyor_sim.line.zone import ZoneDevice
from conveyor_sim.scene.schema import Scene


def sensor_devices(
    scene: Scene, belts: Sequence[BeltDevice], random: Callable[[int], np.random.Generator]
) -> list[Device]:
    """Photo-eyes, zones, counters and indicators. belts: of the scene; random: a stream for the chatter of each eye."""
    zones = {name: ZoneDevice(name, zone) for name, zone in scene.zones.items()}
    counters = {name: CounterDevice(name, counter) for name, counter in scene.counters.items()}
    index = {name: number for number, name in enumerate(scene.belts)}
    indicators = [
        IndicatorDevice(
            name,
            indicator,
            scene.tick,
            counters[indicator.counter],
            zones[indicator.zone],
            belts[index[indicator.belt]],
            None if indicator.downstream is None else belts[index[indicator.downstream]],
            None if indicator.backup is None else zones[indicator.backup],
        )
        for name, indicator in scene.indicators.items()
    ]
    return [*photo_eye_devices(scene, random), *zones.values(), *counters.values(), *indicators]
