"""The devices of a line: the one place where they are put together. What a scene does not name is not there."""

from conveyor_sim.line.belt import BeltDevice
from conveyor_sim.line.device import Device
from conveyor_sim.line.infeed import infeed_devices
from conveyor_sim.line.outfeed import outfeed_devices
from conveyor_sim.model import Model
from conveyor_sim.scene.schema import Scene


def build_devices(scene: Scene, model: Model) -> tuple[Device, ...]:
    """All devices of a scene, in the order in which they act and stand in the process image."""
    return (
        *(BeltDevice(name, index, belt, scene.tick) for index, (name, belt) in enumerate(scene.belts.items())),
        *infeed_devices(scene, model),
        *outfeed_devices(scene),
    )
