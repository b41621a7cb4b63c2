# SPDX-License-Identifier: Apache-2.0
"""Seeds: small, reproducible, different from each other, and never an overlap."""

from typing import Any

import numpy as np
import pytest
from scenes import NO_FLOOR, RADIUS, bottle, contact, line, scene, segment

from conveyor_sim.accuracy.measure.jitter import NUDGE, PLACE, TIMING, disturb, jittered
from conveyor_sim.accuracy.setting import Setting, with_setting
from conveyor_sim.scene import Scene, initial_bottles
from conveyor_sim.simulation import Simulation

GAPS = (0.0, 1e-6, 1e-4, 0.2)
"""m, between bottles in a row."""
RAIL_GAPS = (0.0, 1e-5)
"""m, between bottles and a rail."""
CONTACTS = [contact(5e3, other, damping=("normal", 1.0)) for other in ("glass", "steel")]


def crowd() -> Scene:
    """A row of five in the open, and two bottles at a rail."""
    places = np.cumsum([0.0, *(2.0 * RADIUS + gap for gap in GAPS)])
    bottles = [bottle(x, 1.0) for x in places]
    bottles += [bottle(float(index), RADIUS + gap) for index, gap in enumerate(RAIL_GAPS)]
    return scene(**NO_FLOOR, contacts=CONTACTS, rails={"rail": segment((-1.0, 0.0), (2.0, 0.0))}, bottles=bottles)


def disturbed(seed: int) -> tuple[Simulation, np.ndarray, np.ndarray]:
    """The crowd after `disturb`; how far each bottle moved (m), and its speed (m/s)."""
    simulation = Simulation(crowd(), threads=1)
    before = simulation.bottles()
    disturb(simulation, seed)
    after = simulation.bottles()
    return simulation, np.hypot(after.x - before.x, after.y - before.y), np.hypot(after.vx, after.vy)


def test_bottles_are_displaced_where_there_is_room_and_nudged_where_there_is_none() -> None:
    largest = np.zeros(7)
    for seed in range(200):
        simulation, moved, speeds = disturbed(seed)
        assert len(simulation.contacts().kind) == 0
        assert np.all((moved == 0.0) == (speeds > 0.0))
        assert np.all(speeds <= NUDGE * simulation.scene.slip_limit)
        largest = np.maximum(largest, moved)
    limits = np.array([0.0, 0.0, 1e-6 / 3.0, 1e-4 / 3.0, PLACE * RADIUS, 0.0, 1e-5 / 3.0])
    # Places are rounded to 1e-16 m, of 1e-6 m.
    assert np.all(largest <= limits * (1.0 + 1e-9))
    # The greatest of 200 draws, evenly in a disc, all but surely lies in its outer tenth: 1 - 0.81^200.
    assert np.all(largest >= 0.9 * limits)


def test_a_seed_is_one_disturbance() -> None:
    hashes = [disturbed(seed)[0].state_hash() for seed in (1, 2, 3, 1)]
    assert hashes[3] == hashes[0]
    assert len(set(hashes)) == 3


def test_a_scene_without_bottles_is_left_alone() -> None:
    empty = Simulation(scene(), threads=1)
    disturb(empty, 1)
    assert empty.counts.present == 0


def test_a_dense_grid_of_thousands_never_overlaps() -> None:
    grid = {"type": "bottle", "origin": [0.0, 0.0], "rows": 40, "columns": 50, "pitch": 2.0 * RADIUS + 1e-5,
            "pattern": "hexagonal"}  # fmt: skip
    simulation = Simulation(scene(**NO_FLOOR, contacts=CONTACTS, bottles=[{"grid": grid}]), threads=1)
    start = np.array([place[1:3] for place in initial_bottles(simulation.scene)])
    disturb(simulation, 5)
    bottles = simulation.bottles()
    assert len(simulation.contacts().kind) == 0
    assert np.hypot(bottles.x - start[:, 0], bottles.y - start[:, 1]).max() == pytest.approx(1e-5 / 3.0, rel=1e-2)


def infeed(**fields: Any) -> dict[str, Any]:
    return {"bottle": "bottle", "position": [0.0, 0.0], "direction": 0.3, "speed": 0.5, **fields}


def test_infeeds_are_jittered_as_far_as_rails_leave_room() -> None:
    rail_at = {"free": 1.0, "wide": RADIUS + 1.5 * RADIUS * PLACE, "tight": RADIUS}
    feeds = {name: infeed(gap=0.001, position=[5.0 * index, 0.0]) for index, name in enumerate(rail_at)}
    rails = {
        name: segment((5.0 * index - 0.5, -apart), (5.0 * index + 0.5, -apart))
        for index, (name, apart) in enumerate(rail_at.items())
    }
    it = scene(contacts=CONTACTS, rails=rails, infeeds=feeds)
    changes = jittered(it, 9)["infeeds"]
    assert changes["free"] == {"lateral_jitter": pytest.approx(PLACE * RADIUS)}
    assert changes["wide"] == {"lateral_jitter": pytest.approx(0.5 * PLACE * RADIUS)}
    assert changes["tight"] == {}
    assert with_setting(it, Setting("semi_implicit_euler", 5), **jittered(it, 9)).seed == 9


def test_a_rate_is_jittered_in_time_and_jitter_that_is_there_stays() -> None:
    it = scene(
        contacts=[contact(5e3)],
        infeeds={
            "timed": infeed(rate=4.0),
            "late": infeed(position=[3.0, 0.0], gap=0.001, timing_jitter=0.1),
            "wide": infeed(position=[6.0, 0.0], rate=2.0, lateral_jitter=0.004),
        },
    )
    changes = jittered(it, 1)["infeeds"]
    assert changes.keys() == {"timed"}
    assert changes["timed"] == {"lateral_jitter": PLACE * RADIUS, "timing_jitter": TIMING / 4.0}
    assert jittered(scene(), 4) == {"seed": 4}


def test_jitter_can_be_laid_over_a_line_and_seeds_differ() -> None:
    it = scene(**line())
    setting = Setting("semi_implicit_euler", 50)
    hashes = []
    for seed in (1, 2, 1):
        simulation = Simulation(with_setting(it, setting, **jittered(it, seed)), threads=1)
        disturb(simulation, seed)
        simulation.advance(30)
        hashes.append(simulation.state_hash())
    assert hashes[0] == hashes[2] != hashes[1]
