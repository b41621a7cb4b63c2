# SPDX-License-Identifier: Apache-2.0
"""The scene of a recording draws what it drew when it was recorded."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scenes import scene

from conveyor_sim.bag.messages.encode import FORMAT
from conveyor_sim.bag.recorded_scene import recorded_scene
from conveyor_sim.line.devices.setup import random_stream
from conveyor_sim.simulation import Simulation

PLACE = {"bottle": "bottle", "direction": 0.0, "speed": 0.0}
LINE: dict[str, Any] = {
    "seed": 9, "contacts": [{"between": ["glass", "glass"], "stiffness": 1e4}],
    "infeeds": {
        "first": {**PLACE, "position": [0.0, 0.0], "rate": 1.0},
        "second": {**PLACE, "position": [1.0, 0.0], "rate": 1.0, "bad_share": 0.5, "timing_jitter": 0.3},
    },
    "machines": {
        "eye": {"kind": "inspection", "from": [5.0, 0.0], "to": [5.0, 1.0]},
        "source": {"kind": "source", **PLACE, "position": [2.0, 0.0], "rate": 1.0, "bad_share": 0.5},
    },
    "photo_eyes": {"eye": {"from": [5.0, 0.0], "to": [5.0, 1.0]}},
}  # fmt: skip


def key(*numbers: int) -> dict[str, Any]:
    return np.random.PCG64(np.random.SeedSequence(9, spawn_key=numbers)).state  # type: ignore[return-value]


@pytest.mark.parametrize("format", [1, 2, FORMAT])
def test_streams_are_those_of_when_it_was_recorded(format: int) -> None:
    """By the place of a device in its list, with a branch for each purpose; and by names since."""
    made = scene(**LINE)
    line = SimpleNamespace(
        scene_text=made.source_text, overrides="", integrator="leapfrog", steps_per_tick=10, sweeps=0, format=format
    )
    by_name = format > 1
    simulation = Simulation(recorded_scene(line, "bag"))
    devices: dict[str, Any] = {device.name: device for device in simulation._line._devices}
    found = {
        ("infeeds/second", "bad"): (devices["infeeds/second"].quality, key(1, 1)),
        ("machines/source", "bad"): (devices["machines/source"].quality, key(2, 1)),
        ("photo_eyes/eye", "chatter"): (devices["photo_eyes/eye"], key(3, 0)),
    }
    for (device, purpose), (holder, before) in found.items():
        expected = random_stream(9, device, purpose).bit_generator.state if by_name else before
        drawn = 0 if purpose == "chatter" else holder.count  # those that came at once
        stream = np.random.Generator(np.random.PCG64())
        stream.bit_generator.state = expected
        stream.uniform(size=drawn)
        assert holder.random.bit_generator.state == stream.bit_generator.state, device
    jitter = random_stream(9, "infeeds/second", "jitter") if by_name else np.random.Generator(np.random.PCG64())
    if not by_name:
        jitter.bit_generator.state = key(1)
    assert devices["infeeds/second"].extra == list(jitter.uniform(-0.3, 0.3, size=2))[devices["infeeds/second"].fed]
