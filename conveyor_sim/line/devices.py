"""The devices of a line: the one place where they are put together. What a scene does not name is not there."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from conveyor_sim.line.belt import BeltDevice
from conveyor_sim.line.device import Device
from conveyor_sim.line.drive import DriveDevice
from conveyor_sim.line.entry import Entry, Quality
from conveyor_sim.line.infeed import InfeedDevice
from conveyor_sim.line.inspection import InspectionDevice
from conveyor_sim.line.mover import mover_devices
from conveyor_sim.line.outfeed import OutfeedDevice
from conveyor_sim.line.reject import RejectDevice
from conveyor_sim.line.sensors import sensor_devices
from conveyor_sim.line.sink import SinkDevice
from conveyor_sim.line.source import SourceDevice
from conveyor_sim.line.spill import SpillDevice
from conveyor_sim.model import Model
from conveyor_sim.scene.machines import Machine
from conveyor_sim.scene.parts.inspection import Inspection
from conveyor_sim.scene.parts.sink import Sink
from conveyor_sim.scene.parts.source import Source
from conveyor_sim.scene.schema import Scene

JITTER, QUALITY, MACHINES, PHOTO_EYES = (), (1,), (2,), (3,)
"""Branches of random streams: what infeeds draw of places and of bad bottles, what machines draw, chatter."""


def build_devices(scene: Scene, model: Model) -> tuple[Device, ...]:
    """All devices of a scene, in the order in which they act and stand in the process image."""
    belts = list(_belts(scene))
    return (
        *belts,
        *mover_devices(model),
        *_infeeds(scene, model),
        *(OutfeedDevice(name, outfeed) for name, outfeed in scene.outfeeds.items()),
        *(_machine(name, machine, scene, model, index) for index, (name, machine) in enumerate(scene.machines.items())),
        *(SpillDevice(name, spill, _entry(model, spill.bottle, 0.0, 0.0)) for name, spill in scene.spills.items()),
        *sensor_devices(scene, belts, partial(_random, scene, PHOTO_EYES)),
    )


def _belts(scene: Scene) -> Iterator[BeltDevice]:
    for index, (name, belt) in enumerate(scene.belts.items()):
        if belt.drive is None:
            yield BeltDevice(name, index, belt, scene.tick)
        else:
            yield DriveDevice(name, index, belt, belt.drive, scene.tick)


def _infeeds(scene: Scene, model: Model) -> Iterator[InfeedDevice]:
    for index, (name, infeed) in enumerate(scene.infeeds.items()):
        entry = _entry(model, infeed.bottle, infeed.direction, infeed.speed)
        quality = Quality(infeed.bad_share, infeed.bad_every, _random(scene, QUALITY, index))
        yield InfeedDevice(name, infeed, entry, quality, _random(scene, JITTER, index))


def _machine(name: str, machine: Machine, scene: Scene, model: Model, index: int) -> Device:
    if isinstance(machine, Source):
        entry = _entry(model, machine.bottle, machine.direction, machine.speed)
        quality = Quality(machine.bad_share, machine.bad_every, _random(scene, MACHINES, index))
        return SourceDevice(name, machine, entry, quality)
    if isinstance(machine, Sink):
        return SinkDevice(name, machine)
    return InspectionDevice(name, machine) if isinstance(machine, Inspection) else RejectDevice(name, machine)


def _entry(model: Model, bottle: str, direction: float, speed: float) -> Entry:
    kind = model.bottle_types.index(bottle)
    return Entry(kind, float(model.type_radius[kind]), direction, speed)


def _random(scene: Scene, branch: tuple[int, ...], index: int) -> np.random.Generator:
    """A random stream of its own."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(scene.seed, spawn_key=(*branch, index))))
