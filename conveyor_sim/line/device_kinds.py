# SPDX-License-Identifier: Apache-2.0
"""Table of device classes by kind of part, and the devices of a scene."""

from collections.abc import Callable, Mapping
from typing import Any

from conveyor_sim.line.device import Device
from conveyor_sim.line.devices.axis import AxisDevice
from conveyor_sim.line.devices.belt import belt_device
from conveyor_sim.line.devices.carousel import CarouselDevice
from conveyor_sim.line.devices.crossing import CounterDevice, InspectionDevice
from conveyor_sim.line.devices.divider import PositionedDevice
from conveyor_sim.line.devices.drive import NamedDriveDevice
from conveyor_sim.line.devices.geared_machine import ScrewDevice, StarDevice
from conveyor_sim.line.devices.indicator import IndicatorDevice
from conveyor_sim.line.devices.infeed import InfeedDevice
from conveyor_sim.line.devices.lifting_gate import gate_device
from conveyor_sim.line.devices.mover import Mover
from conveyor_sim.line.devices.panel import (
    ButtonDevice,
    EmergencyStopDevice,
    LightsDevice,
    NumberFieldDevice,
    SelectorDevice,
)
from conveyor_sim.line.devices.photo_eye import PhotoEyeDevice
from conveyor_sim.line.devices.region import OutfeedDevice, ZoneDevice
from conveyor_sim.line.devices.reject import RejectDevice
from conveyor_sim.line.devices.row_pusher import pusher_device
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.devices.side_belt import side_belt_device
from conveyor_sim.line.devices.spill import SpillDevice
from conveyor_sim.line.machines.carrier import station_device
from conveyor_sim.line.machines.source import SourceDevice
from conveyor_sim.line.machines.station import SinkDevice
from conveyor_sim.physics.model import Model
from conveyor_sim.scene.schema import Scene

DEVICES: Mapping[str, Callable[[str, Any, DeviceSetup], Device]] = {
    "button": ButtonDevice,
    "selector": SelectorDevice,
    "emergency_stop": EmergencyStopDevice,
    "lamp": LightsDevice,
    "horn": LightsDevice,
    "stack_light": LightsDevice,
    "numeric": NumberFieldDevice,
    "drive": NamedDriveDevice,
    "axis": AxisDevice,
    "belt": belt_device,
    "gate": gate_device,
    "pusher": pusher_device,
    "diverter": Mover,
    "divider": PositionedDevice,
    "adjustable": PositionedDevice,
    "clamp": Mover,
    "star": StarDevice,
    "carousel": CarouselDevice,
    "screw": ScrewDevice,
    "side_belt": side_belt_device,
    "infeed": InfeedDevice,
    "outfeed": OutfeedDevice,
    "source": SourceDevice,
    "sink": SinkDevice,
    "station": station_device,
    "inspection": InspectionDevice,
    "reject": RejectDevice,
    "spill": SpillDevice,
    "photo_eye": PhotoEyeDevice,
    "zone": ZoneDevice,
    "counter": CounterDevice,
    "indicator": IndicatorDevice,
}
"""Device class by kind of a part (`DevicePart.KIND`). Arguments: name (`zones/exit`), the part, and DeviceSetup."""


def build_devices(scene: Scene, model: Model) -> tuple[Device, ...]:
    """Build all devices of a scene, in the order in which they act and stand in the process image."""
    setup = DeviceSetup(scene, model)
    for (field, name), part in scene.devices():
        device = DEVICES[part.KIND](f"{field}/{name}", part, setup)
        device.classify(part.KIND)
        setup.devices[device.name] = device
    return tuple(setup.devices.values())
