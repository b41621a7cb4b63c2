# SPDX-License-Identifier: Apache-2.0
"""`DeviceSetup`: arguments of device constructors besides their part of the scene, and random streams.

Every purpose of every device has its own stream of random numbers, so two variants of a line draw equal numbers.
"""

import math
from collections.abc import Callable
from hashlib import blake2b
from typing import TypeVar

import numpy as np

from conveyor_sim.engine.sensors.region_search import RegionSearch
from conveyor_sim.line.device import Device
from conveyor_sim.line.devices.entry import BottleEntry
from conveyor_sim.line.devices.power import PowerSupply
from conveyor_sim.physics.model import Model
from conveyor_sim.scene.driven import speed_limits
from conveyor_sim.scene.geometry import shapes_of_belt
from conveyor_sim.scene.parts.panel import Load
from conveyor_sim.scene.schema import Scene

JITTER, BAD, CHATTER, BOUNCE = "jitter", "bad", "chatter", "bounce"
"""Purposes of random streams: times, places and directions of new bottles, bad bottles, chatter of photo-eyes, bounce
of contacts."""

BRANCHES = {(JITTER, "infeeds"): (), (BAD, "infeeds"): (1,), (BAD, "machines"): (2,), (CHATTER, "photo_eyes"): (3,)}
"""Prefixes of the spawn keys in recordings from before streams were named, by purpose and field of the scene. The index
in the field follows."""

MOST_TICKS = 2**52
"""Largest number of ticks of a device: checkpoints store integers up to 2**53."""

D = TypeVar("D", bound=Device)


class DeviceSetup:
    """Scene, model, and the devices built so far."""

    def __init__(self, scene: Scene, model: Model) -> None:
        self.scene, self.model = scene, model
        self.devices: dict[str, Device] = {}
        """Devices by name, in the order in which they act."""
        self.regions = RegionSearch()
        """Search for the bottles in the regions of all devices."""

    def device(self, kind: type[D], name: str) -> D:
        """Return a device built before, `zones/exit`. Raise KeyError if there is none."""
        device = self.devices[name]
        assert isinstance(device, kind)
        return device

    def shared(self, kind: type[D], make: Callable[[], D]) -> D:
        """Return the one device of a kind that several devices share. Its first user builds it, so it acts earlier."""
        for device in self.devices.values():
            if isinstance(device, kind):
                return device
        made = make()
        self.devices[made.name] = made
        return made

    def power(self, load: Load, device: Device) -> PowerSupply | None:
        """Connect a consumer to the power supply. Return None if no emergency stop can take its power."""
        supply = self.devices.get("power")
        return supply if isinstance(supply, PowerSupply) and supply.feeds(load, device) else None

    def index(self, field: str, name: str) -> int:
        """Return the index of a part in its field of the scene, from 0."""
        return list(getattr(self.scene, field)).index(name)

    def speed_index(self, device: str) -> int:
        """Return the index of a belt ("belts/main") or a named drive in the speeds of a ScanContext."""
        field, _, name = device.partition("/")
        return self.index(field, name) + (len(self.scene.belts) if field == "drives" else 0)

    def ticks(self, seconds: float) -> int:
        """Return the first tick at which `seconds` have passed, at most MOST_TICKS."""
        return min(math.ceil(seconds / self.scene.tick - 1e-9), MOST_TICKS)

    def entry(self, bottle: str, direction: float, speed: float) -> BottleEntry:
        """Return the entry of bottles of a type in a direction (rad) at a speed (m/s)."""
        kind = self.model.bottle_types.index(bottle)
        return BottleEntry(kind, float(self.model.type_radius[kind]), direction, speed)

    def fastest_flow(self, belt: str) -> float:
        """Return the largest flow of a belt, 1/s: the smallest bottles, touching, in all lanes of all surfaces."""
        diameter = 2.0 * float(self.model.type_radius.min())
        shapes = shapes_of_belt(belt, self.scene.belts[belt])
        lanes = sum(shape.ratio * max(1, int(shape.width / diameter)) for shape in shapes)
        return max(map(abs, speed_limits(self.scene, belt))) / diameter * lanes

    def random(self, device: str, purpose: str) -> np.random.Generator:
        """Return the random stream of a device for one purpose."""
        if self.scene.streams_by_index:
            field, _, name = device.partition("/")
            key = (*BRANCHES[purpose, field], self.index(field, name))
            return np.random.Generator(np.random.PCG64(np.random.SeedSequence(self.scene.seed, spawn_key=key)))
        return random_stream(self.scene.seed, device, purpose)


WORDS = 4
"""Number of 32-bit words that stand for a device and a purpose in the key of its stream."""


def random_stream(seed: int, device: str, purpose: str) -> np.random.Generator:
    """Return the random stream of a device ("infeeds/inlet") for one purpose ("jitter"), from the seed of a scene.

    Streams are keyed by names, not by indices, so other parts of the line do not change them. A hash of both names is
    the spawn key of NumPy's SeedSequence, which makes independent streams of one seed.
    """
    digest = blake2b(f"{device}\0{purpose}".encode(), digest_size=4 * WORDS).digest()
    key = tuple(int.from_bytes(digest[4 * n : 4 * n + 4], "little") for n in range(WORDS))
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=key)))
