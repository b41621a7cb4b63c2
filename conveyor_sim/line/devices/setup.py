"""`DeviceSetup`: what a device is made from, beside its part of the scene."""

from collections.abc import Callable
from hashlib import blake2b
from typing import TypeVar

import numpy as np

from conveyor_sim.line.device import Device
from conveyor_sim.line.devices.entry import BottleEntry
from conveyor_sim.physics.model import Model
from conveyor_sim.scene.schema import Scene

JITTER, BAD, CHATTER = "jitter", "bad", "chatter"
"""Purposes of random streams: what infeeds draw of times and places, which bottles are bad, when photo-eyes chatter."""

BRANCHES = {(JITTER, "infeeds"): (), (BAD, "infeeds"): (1,), (BAD, "machines"): (2,), (CHATTER, "photo_eyes"): (3,)}
"""Of streams before they had names, by purpose and field of the scene: the spawn key before the place in the field."""

D = TypeVar("D", bound=Device)


class DeviceSetup:
    """A scene, its model, and the devices made so far."""

    def __init__(self, scene: Scene, model: Model) -> None:
        self.scene, self.model = scene, model
        self.devices: dict[str, Device] = {}
        """By name, in the order in which they act."""

    def device(self, kind: type[D], name: str) -> D:
        """A device made before, `zones/exit`. KeyError if there is none."""
        found = self.devices[name]
        assert isinstance(found, kind)
        return found

    def shared(self, kind: type[D], make: Callable[[], D]) -> D:
        """The one device of a kind that several rest on; the first that asks has it made, and it acts before them."""
        for device in self.devices.values():
            if isinstance(device, kind):
                return device
        made = make()
        self.devices[made.name] = made
        return made

    def index(self, field: str, name: str) -> int:
        """The place of a part in its field of the scene, from 0."""
        return list(getattr(self.scene, field)).index(name)

    def entry(self, bottle: str, direction: float, speed: float) -> BottleEntry:
        """Where bottles of a type enter in a direction (rad) at a speed (m/s)."""
        kind = self.model.bottle_types.index(bottle)
        return BottleEntry(kind, float(self.model.type_radius[kind]), direction, speed)

    def fastest_flow(self, belt: str) -> float:
        """Bottles a second that a belt can bring at most: the smallest ones, touching in as many lanes as there are."""
        shape = self.scene.belts[belt]
        diameter = 2.0 * float(self.model.type_radius.min())
        return max(map(abs, shape.speed_limits)) / diameter * max(1, int(shape.width / diameter))

    def random(self, device: str, purpose: str) -> np.random.Generator:
        """A random stream of a device's own, for a purpose of its own."""
        if self.scene.streams_by_index:
            field, _, name = device.partition("/")
            key = (*BRANCHES[purpose, field], self.index(field, name))
            return np.random.Generator(np.random.PCG64(np.random.SeedSequence(self.scene.seed, spawn_key=key)))
        return random_stream(self.scene.seed, device, purpose)


WORDS = 4
"""Of 32 bits, that stand for a device and a purpose in the key of its stream."""


def random_stream(seed: int, device: str, purpose: str) -> np.random.Generator:
    """The stream of one purpose ("jitter") of a device, by its name ("infeeds/inlet"), from the seed of a scene.

    Keyed by names and not by places in a list: what else is on the line changes nothing. A hash of both is the spawn
    key of NumPy's SeedSequence, which makes independent streams of one seed.
    """
    digest = blake2b(f"{device}\0{purpose}".encode(), digest_size=4 * WORDS).digest()
    key = tuple(int.from_bytes(digest[4 * n : 4 * n + 4], "little") for n in range(WORDS))
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=key)))
