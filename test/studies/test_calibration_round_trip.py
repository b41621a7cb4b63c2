# SPDX-License-Identifier: Apache-2.0
"""Measurements that the simulator makes itself give back the parameters of its scene.

The readings get an error of 1 %, because an interval of exact readings has no width.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import NO_FLOOR, RADIUS, belt, bottle, kind, segment, simulation
from studies.measurement_file import write

from conveyor_sim.scene import parse_scene
from conveyor_sim.studies.calibration.calibrate import ContactValues, calibrate
from conveyor_sim.studies.calibration.entries import entries
from conveyor_sim.studies.calibration.friction import GRAVITY

MU, LIMIT, E, LINEAR, HERTZ = 0.18, 0.012, 0.72, 40e3, 3e6
ERROR = 0.01
LENGTH = 1.0
"""m, of the pendulum."""
STEPS = 2000
"""Steps of a tick in impacts, whose errors in the restitution must be small beside those of the readings."""
MASSES = (0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6)
SPEEDS = (0.001, 0.002, 0.004, 0.007, 0.01, 0.02, 0.1, 0.3)
PAIR = {"material": "glass", "other": "steel"}


def read_with_error(values: NDArray[np.float64], seed: int) -> NDArray[np.float64]:
    return values * (1.0 + ERROR * np.random.default_rng(seed).normal(size=values.shape))


def contacts(elastic: dict[str, float], damping: dict[str, Any]) -> list[dict[str, Any]]:
    return [{"between": ["glass", other], **elastic, "damping": damping} for other in ("glass", "steel")]


def pressed(speeds: tuple[float, ...], elastic: dict[str, float]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Hold bottles of MASSES, each on a chain with its speed, at a stop. Return overlaps (m) and forces (N) at rest."""
    lanes = range(len(MASSES))
    sim = simulation(
        gravity=GRAVITY,
        slip_limit=LIMIT,
        contacts=contacts(elastic, {"law": "normal", "restitution": 0.5}),
        base=[{"between": ["glass", "chain"], "friction": MU}],
        bottle_types={f"type_{lane}": kind(mass=MASSES[lane]) for lane in lanes},
        belts={f"chain_{lane}": belt(speeds[lane], (-2.0, 0.2 * lane), 4.0, 0.2) for lane in lanes},
        rails={"stop": segment((RADIUS, -1.0), (RADIUS, 3.0))},
        bottles=[{**bottle(0.0, 0.2 * lane + 0.1), "type": f"type_{lane}"} for lane in lanes],
    )
    sim.advance(400)
    touching = sim.contacts()
    order = np.argsort(touching.a)
    assert len(order) == len(MASSES)
    return touching.overlap[order], touching.normal_force[order]


def rebounds(speeds: NDArray[np.float64], elastic: dict[str, float], damping: dict[str, Any]) -> NDArray[np.float64]:
    """Return the speeds (n,) of bottles after they hit a rail with some speeds (n,)."""
    sim = simulation(
        accuracy={"per_tick": STEPS},
        contacts=contacts(elastic, damping),
        rails={"plate": segment((RADIUS + 0.01, -1.0), (RADIUS + 0.01, 5.0))},
        bottles=[bottle(0.0, 0.3 * place, float(speed)) for place, speed in enumerate(speeds)],
        **NO_FLOOR,
    )
    sim.advance(20)
    bottles = sim.bottles()
    assert (bottles.vx < 0.0).all() and len(sim.contacts().a) == 0
    return -bottles.vx


def only_contact(path: Path) -> ContactValues:
    (contact,) = calibrate(path).contacts
    return contact


def test_friction_from_bottles_held_on_a_running_chain(tmp_path: Path) -> None:
    _, forces = pressed((0.3,) * len(MASSES), {"stiffness": LINEAR})
    pairs = zip(MASSES, read_with_error(forces, 1), strict=True)
    rows = [{"quantity": "base_friction", **PAIR, "force": force, "mass": mass} for mass, force in pairs]
    estimate = calibrate(write(tmp_path / "data.csv", rows)).base["glass", "steel"]
    assert estimate.low <= MU <= estimate.high
    assert estimate.high - estimate.low < 0.05 * MU


def test_contact_friction_from_bottles_pulled_along_a_rail(tmp_path: Path) -> None:
    """Bottles that can't turn reach a constant speed on a chain at an angle to the rail: the pull equals the friction.

    The pull follows from the slip on the chain, since friction of the base acts along it.
    """
    angle, speed, friction = math.radians(35.0), 0.3, 0.27
    lanes = range(len(MASSES))
    contact = {"stiffness": LINEAR, "friction": friction, "damping": {"law": "normal", "restitution": 0.5}}
    sim = simulation(
        gravity=GRAVITY,
        contacts=[{"between": ["glass", other], **contact} for other in ("glass", "steel")],
        base=[{"between": ["glass", "chain"], "friction": MU}],
        bottle_types={f"type_{lane}": kind(mass=MASSES[lane]) for lane in lanes},
        belts={"chain": belt(speed, (0.0, -10.0), 30.0, 30.0, angle=angle)},
        rails={"rail": segment((8.0, RADIUS), (-4.0, RADIUS))},
        bottles=[{**bottle(0.3 * lane, 0.0), "type": f"type_{lane}"} for lane in lanes],
        effects={"rotation": "off"},
    )
    sim.advance(300)
    bottles, touching = sim.bottles(), sim.contacts()
    order = np.argsort(touching.a)
    assert touching.a[order].tolist() == bottles.id.tolist()
    normal = touching.normal_force[order]
    pull = normal * (speed * math.cos(angle) - bottles.vx) / (speed * math.sin(angle))
    rows = [
        {"quantity": "contact_friction", **PAIR, "force": force, "normal_force": pressing}
        for force, pressing in zip(read_with_error(pull, 11), normal, strict=True)
    ]
    estimate = only_contact(write(tmp_path / "data.csv", rows)).friction
    assert estimate is not None
    assert estimate.low <= friction <= estimate.high
    assert estimate.high - estimate.low < 0.05 * friction


def test_vibration_from_a_body_that_lies_on_the_chain(tmp_path: Path) -> None:
    """The peak of the spectrum of its acceleration gives amplitude, frequency and axis of the chain's vibration."""
    amplitude, frequency, direction = 20e-6, 25.0, math.radians(30.0)
    vibration = {"amplitude": amplitude, "frequency": frequency, "direction": direction}
    sim = simulation(
        tick=0.001,
        gravity=GRAVITY,
        slip_limit=0.0005,
        base=[{"between": ["glass", "chain"], "friction": 0.5}],
        belts={"chain": belt(0.2, vibration=vibration)},
        bottles=[bottle(0.0, 0.0, 0.2)],
    )
    sim.advance(1000)
    velocities = []
    for _ in range(1000):
        sim.advance()
        now = sim.bottles()
        velocities.append((now.vx[0], now.vy[0]))
    along = np.array(velocities) @ np.array([[math.cos(direction)], [math.sin(direction)]])
    spectrum = np.abs(np.fft.rfft(along[:, 0])) / 500.0
    peak = int(spectrum[1:].argmax()) + 1
    readings = read_with_error(np.full(5, 2.0 * math.pi * peak * spectrum[peak]), 9)
    x, y = np.array(velocities).std(axis=0)
    axes = read_with_error(np.full(5, math.atan2(y, x)), 10)
    rows = [
        {
            "quantity": "vibration",
            "material": "",
            "other": "chain",
            "acceleration": reading,
            "frequency": peak,
            "direction": axis,
        }
        for reading, axis in zip(readings, axes, strict=True)
    ]
    found = calibrate(write(tmp_path / "data.csv", rows)).vibrations["chain"]
    assert found.frequency.value == frequency
    assert found.amplitude.low <= amplitude <= found.amplitude.high
    assert found.amplitude.high - found.amplitude.low < 0.05 * amplitude
    assert found.direction.low <= direction <= found.direction.high


def test_slip_limit_from_bottles_held_on_slow_chains(tmp_path: Path) -> None:
    _, forces = pressed(SPEEDS, {"stiffness": LINEAR})
    triples = zip(MASSES, SPEEDS, read_with_error(forces, 2), strict=True)
    rows = [
        {"quantity": "slip_limit", **PAIR, "force": force, "mass": mass, "speed": speed}
        for mass, speed, force in triples
    ]
    result = calibrate(write(tmp_path / "data.csv", rows))
    assert result.slip_limit is not None
    assert result.slip_limit.low <= LIMIT <= result.slip_limit.high
    assert result.slip_limit.high - result.slip_limit.low < 0.3 * LIMIT
    estimate = result.base["glass", "steel"]
    assert estimate.low <= MU <= estimate.high


@pytest.mark.parametrize(("field", "true"), [("stiffness", LINEAR), ("hertz_stiffness", HERTZ)])
def test_stiffness_from_overlaps_at_a_stop(tmp_path: Path, field: str, true: float) -> None:
    overlaps, forces = pressed((0.3,) * len(MASSES), {field: true})
    pairs = zip(overlaps, read_with_error(forces, 3), strict=True)
    rows = [{"quantity": "compression", **PAIR, "overlap": overlap, "force": force} for overlap, force in pairs]
    law = only_contact(write(tmp_path / "data.csv", rows)).elastic
    assert law is not None and law.field == field and law.value is not None
    assert law.value.low <= true <= law.value.high
    assert law.value.high < 1.5 * law.value.low


def test_restitution_from_drops(tmp_path: Path) -> None:
    heights = np.repeat([0.05, 0.1, 0.2], 4)
    after = rebounds(np.sqrt(2.0 * GRAVITY * heights), {"stiffness": LINEAR}, {"law": "normal", "restitution": E})
    reached = read_with_error(after**2 / (2.0 * GRAVITY), 4)
    rows = [
        {"quantity": "drop", **PAIR, "drop_height": height, "rebound_height": rebound}
        for height, rebound in zip(heights, reached, strict=True)
    ]
    found = only_contact(write(tmp_path / "data.csv", rows)).restitution
    assert found is not None and not found.falls
    assert found.value.low <= E <= found.value.high
    assert found.value.high - found.value.low < 0.02


def test_a_restitution_that_falls_with_the_speed_gives_back_its_law(tmp_path: Path) -> None:
    """Viscoelastic contacts: pasted into a scene, the entry has the restitution of the scene that was measured."""
    damping = {"law": "viscoelastic", "restitution": E, "speed": 0.8}
    angles = np.repeat(np.radians([8.0, 20.0, 45.0, 80.0]), 3)
    speeds = 2.0 * math.sqrt(GRAVITY * LENGTH) * np.sin(0.5 * angles)
    after = rebounds(speeds, {"hertz_stiffness": HERTZ}, damping)
    swung = 2.0 * np.arcsin(read_with_error(after, 5) / (2.0 * math.sqrt(GRAVITY * LENGTH)))
    rows = [
        {"quantity": "pendulum", **PAIR, "length": LENGTH, "angle_before": before, "angle_after": angle}
        for before, angle in zip(angles, swung, strict=True)
    ]
    found = only_contact(write(tmp_path / "data.csv", rows)).restitution
    assert found is not None and found.falls
    again = {"law": "viscoelastic", "restitution": found.value.value, "speed": found.speed}
    ends = np.array([speeds.min(), speeds.max()])
    assert rebounds(ends, {"hertz_stiffness": HERTZ}, again) == pytest.approx(
        rebounds(ends, {"hertz_stiffness": HERTZ}, damping), rel=0.03
    )


def test_restitution_from_a_pair_of_pendulums(tmp_path: Path) -> None:
    releases = np.radians(np.repeat([15.0, 30.0], 4))
    speeds = 2.0 * math.sqrt(GRAVITY * LENGTH) * np.sin(0.5 * releases)
    places = range(len(speeds))
    sim = simulation(
        accuracy={"per_tick": STEPS},
        contacts=contacts({"stiffness": LINEAR}, {"law": "normal", "restitution": E}),
        rails={"far": segment((9.0, -1.0), (9.0, 5.0))},
        bottles=[
            *(bottle(0.0, 0.3 * place, float(speeds[place])) for place in places),
            *(bottle(2.0 * RADIUS + 0.01, 0.3 * place) for place in places),
        ],
        **NO_FLOOR,
    )
    sim.advance(20)
    assert len(sim.contacts().a) == 0
    angles = 2.0 * np.arcsin(sim.bottles().vx / (2.0 * math.sqrt(GRAVITY * LENGTH)))
    first, second = angles[: len(speeds)], read_with_error(angles[len(speeds) :], 6)
    assert (first > 0.0).all(), "the hitting bottle follows"
    rows = [
        {"quantity": "pendulum_pair", "material": "glass", "other": "glass", "length": LENGTH,
         "angle_before": releases[place], "angle_after": -first[place], "angle_struck": second[place]}
        for place in places
    ]  # fmt: skip
    found = only_contact(write(tmp_path / "data.csv", rows)).restitution
    assert found is not None
    assert found.value.low <= E <= found.value.high
    assert found.value.high - found.value.low < 0.05


def test_the_printed_entries_load_as_a_scene(tmp_path: Path) -> None:
    overlaps, forces = pressed((0.3,) * len(MASSES), {"hertz_stiffness": HERTZ})
    pressings = zip(overlaps, read_with_error(forces, 7), strict=True)
    rows: list[dict[str, object]] = [
        {"quantity": "compression", **PAIR, "overlap": overlap, "force": force} for overlap, force in pressings
    ]
    rows += [{"quantity": "drop", **PAIR, "drop_height": 0.1, "rebound_height": height} for height in (0.05, 0.052)]
    rows += [
        {"quantity": "base_friction", "material": "glass", "other": "chain", "force": force, "mass": 0.35}
        for force in (0.5, 0.52)
    ]
    text = entries(calibrate(write(tmp_path / "data.csv", rows)), "data.csv")
    bottle_types = "bottle_types: {bottle: {radius: 33 mm, mass: 350 g, material: glass}}\n"
    scene = parse_scene(f"name: pasted\nduration: 1\n{bottle_types}{text}")
    (contact,), (base,) = scene.contacts, scene.base
    assert contact.between == ("glass", "steel") and base.between == ("glass", "chain")
    assert contact.hertz_stiffness == pytest.approx(HERTZ, rel=0.2)
    assert contact.damping.restitution == pytest.approx(math.sqrt(0.51), rel=0.01)
    assert base.friction == pytest.approx(0.51 / (0.35 * GRAVITY), rel=0.01)
