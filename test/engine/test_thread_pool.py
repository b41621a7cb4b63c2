# SPDX-License-Identifier: Apache-2.0
"""Threads give the same bits in any number."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scenes import COMMON, SPRINGS_AND_RINGS, base, belt, contact, kind, polyline, scene, with_bends
from swept import QUEUE

from conveyor_sim.engine.threads.thread_pool import ThreadPool
from conveyor_sim.engine.threads.workers import BLOCK
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

ROWS, COLUMNS, PITCH = 30, 40, 0.131


def crowd(**fields: Any) -> Scene:
    """Return 1200 bottles in a box on two belts with opposite directions: several blocks of bottles and of pairs."""
    width, height = COLUMNS * PITCH + 0.1, ROWS * PITCH + 0.1
    box = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)]
    laws = {"damping": ("normal", 1.0), "friction": 0.2}
    base_fields: dict[str, Any] = {
        "bottle_types": {"bottle": kind(), "slim": kind(0.06, 0.15)},
        "contacts": [contact(5000.0, **laws), contact(8000.0, "steel", **laws)],
        "base": base(0.4),
        "belts": {
            "left": belt(0.9, (-0.5, -0.5), width / 2 + 0.5, height + 1.0),
            "right": belt(-0.9, (width / 2, -0.5), width / 2 + 0.5, height + 1.0),
        },
        "rails": {"box": polyline(box, closed=True)},
        "bottles": [
            {"grid": {"type": name, "origin": [0.1, 0.1 + first * PITCH], "rows": ROWS // 2, "columns": COLUMNS,
                      "pitch": PITCH}}
            for name, first in (("bottle", 0), ("slim", ROWS // 2))
        ],
        "accuracy": {"per_tick": 50},
        "effects": COMMON,
    }  # fmt: skip
    return scene(**with_bends({**base_fields, **fields}))


VARIANTS: dict[str, dict[str, Any]] = {
    "as it is": {},
    "velocity Verlet": {"accuracy": {"per_tick": 50, "integrator": "velocity_verlet"}},
    "Dormand and Prince": {"accuracy": {"per_tick": 25, "integrator": "dormand_prince", "error": 1e-3}},
    "linearly implicit": {"accuracy": {"per_tick": 10, "integrator": "linearly_implicit"}},
    "implicit friction": {"friction_solver": "implicit"},
    "static friction": {
        "base": [{**base(0.4)[0], "tangential": {"stiffness": 2000.0, "damping": 20.0}}],
        "accuracy": {"per_tick": 50, "integrator": "velocity_verlet"},
    },
    "springs and rings": SPRINGS_AND_RINGS,
    "impulses": QUEUE,
}


@pytest.mark.parametrize("name", VARIANTS)
def test_the_same_bits_on_any_number_of_threads(name: str) -> None:
    """The run is long enough for impacts and rebuilds; there may be more threads than blocks."""
    ticks, tested = 15, crowd(**VARIANTS[name])
    one = Simulation(tested, threads=1)
    one.advance(ticks)
    assert one._state.world.bottles.id.size > 2 * BLOCK
    assert one.contacts().kind.size > 100
    for threads in (2, 3, 7):
        other = Simulation(tested, threads=threads)
        other.advance(ticks)
        assert other.full_state_hash() == one.full_state_hash(), threads
        np.testing.assert_array_equal(other.bottles().peak_force, one.bottles().peak_force)
        np.testing.assert_array_equal(other.bottles().impulse, one.bottles().impulse)
        np.testing.assert_array_equal(other.contacts().tangential_force, one.contacts().tangential_force)


def test_the_number_may_change_from_tick_to_tick() -> None:
    tested = crowd()
    one, other = Simulation(tested, threads=1), Simulation(tested, threads=3)
    one.advance(9)
    pool, sizes = other.integration._pool, [1, 3, 2, 2, 1, 3, 1, 2, 3]
    for size in sizes:
        steps = other.model.steps_per_tick
        other._line.begin(other.tick)
        assert pool.advance(size, other.integration._advance, other._state.world, steps, other.model.dt, 0) == steps
        other.tick += 1
    assert other.state_hash() == one.state_hash()


def test_a_team_has_a_size() -> None:
    with pytest.raises(ValueError, match="a group of 3 threads, expected 1 to 2"):
        ThreadPool(2).group(3)
    with pytest.raises(ValueError, match="threads: 0, expected 1 or more"):
        Simulation(crowd(), threads=0)


def test_a_thread_that_fails_is_heard_and_the_crew_goes_on() -> None:
    """An exception in a worker reaches the caller; the next call uses a new group."""

    def failing(_world: Any, worker: Any, _steps: int, _dt: float, _phase: int) -> int:
        if worker.rank > 0:
            raise ArithmeticError("rank 1")
        return 0

    sim = Simulation(crowd(), threads=2)
    pool, world = sim.integration._pool, sim._state.world
    pool._entries[failing] = failing
    with pytest.raises(ArithmeticError, match="rank 1"):
        pool.advance(2, failing, world, 1, 1e-5, 0)
    other = Simulation(crowd(), threads=1)
    sim.advance(3)
    other.advance(3)
    assert sim.full_state_hash() == other.full_state_hash()


def test_a_process_of_another_number_has_threads_of_its_own() -> None:
    """A fork copies queues, not threads, so a pool in a child process must not wait for threads of the parent."""
    sim, other = Simulation(crowd(), threads=2), Simulation(crowd(), threads=1)
    sim.advance(2)
    tasks = list(sim.integration._pool._tasks)
    sim.integration._pool._process = -1  # as in a child process
    sim.advance(1)
    assert sim.integration._pool._tasks[0] is not tasks[0]
    other.advance(3)
    assert sim.full_state_hash() == other.full_state_hash()
