# SPDX-License-Identifier: Apache-2.0
"""Settling of queues with integrator impulses: its closed form, and files that settle as predicted."""

import math

import numpy as np
import pytest
from scenes import MASS, scene
from swept import MU_BASE, G, fields, file_of, forces_on, run, swept

from conveyor_sim.engine.impulses.constants import OVER, OVER_ONE
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.timestep.settling import DECAYS, LOAD_TIME, settling
from conveyor_sim.simulation import Simulation


@pytest.mark.parametrize(("sweeps", "over"), [(1, OVER_ONE), (2, OVER)])
def test_the_decay_is_that_of_sweeps_over_a_chain(sweeps: int, over: float) -> None:
    """Largest eigenvalue of a sweep over the contacts of a file with over-relaxation, from its matrix."""
    count = 40
    chain = 2.0 * np.eye(count) - np.eye(count, k=1) - np.eye(count, k=-1)
    chain[0, 0] = 1.0  # the contact with the stop: one bottle moves
    lower = np.tril(chain, -1) + np.diag(np.diag(chain)) / over
    left = float(np.abs(np.linalg.eigvals(np.eye(count) - np.linalg.solve(lower, chain))).max())
    # Half of the share by which a sweep reduces the error is the rate of decay, because bottles keep velocities.
    expected = DECAYS * 2.0 / ((1.0 - left) * sweeps * 800.0)
    assert settling(8, sweeps, 0.01, count, "").seconds(count) == pytest.approx(expected, rel=0.04)


@pytest.mark.parametrize(("count", "steps", "sweeps"), [(30, 4, 1), (30, 8, 2), (30, 16, 1), (60, 8, 2)])
def test_a_file_settles_in_the_predicted_time(count: int, steps: int, sweeps: int) -> None:
    """The force on the stop stays within 3 % of n mu m g from then on, within a quarter of the time."""
    sim = run(steps, sweeps, **file_of(count, gap=0.0))
    settles = settling(steps, sweeps, 0.01, count, "").seconds(count)
    assert settled_after(sim, count, 1.5 * settles) == pytest.approx(settles, rel=0.25)


def test_explicit_steps_settle_with_the_waves_of_the_file() -> None:
    """The time does not grow with the square of the queue: at 8 x 2 these files need 0.6 and 2.9 s."""
    explicit = {"integrator": "leapfrog", "per_tick": 1000}
    for count, seconds in ((30, 0.50), (60, 0.54)):
        sim = Simulation(scene(**fields(**file_of(count, gap=0.0)) | {"accuracy": explicit}), threads=1)
        assert settled_after(sim, count, 1.5) == pytest.approx(seconds, abs=0.1)


def settled_after(sim: Simulation, count: int, most: float) -> float:
    """Return the time after which the force on the stop stays within 3 % of n mu m g, until `most` s."""
    load = count * MU_BASE * MASS * G
    off = []
    for _ in range(math.ceil(most / 0.01)):
        sim.advance(1)
        off.append(abs(forces_on(sim, "stop") / load - 1.0))
    return float(0.01 * (1 + np.flatnonzero(np.array(off) > 0.03)[-1]))


def test_the_bound_falls_with_sweeps_and_grows_with_the_square_of_the_queue() -> None:
    at = {key: settling(*key, 0.01, 0, "") for key in ((4, 1), (8, 1), (8, 2), (16, 1), (16, 2))}
    assert at[8, 1].seconds(60) == pytest.approx(0.5 * at[4, 1].seconds(60))
    assert at[16, 2].seconds(60) == pytest.approx(0.5 * at[8, 2].seconds(60))
    assert at[8, 2].seconds(60) == pytest.approx(4.0 * at[8, 2].seconds(30), rel=0.02)
    assert at[8, 2].seconds(60) < at[16, 1].seconds(60)
    for one in at.values():
        assert one.seconds(one.longest) <= LOAD_TIME < one.seconds(one.longest + 1)


def test_the_sentence_has_queue_and_time() -> None:
    words = settling(8, 2, 0.01, 60, "a reason").sentence
    assert "1600 sweeps per second" in words and "a queue of 60 (a reason) settles in about 2.8 s" in words
    assert "a queue" not in settling(8, 2, 0.01, 0, "").sentence


def test_only_impulses_settle_by_sweeps() -> None:
    for accuracy, rate in ((swept(8, 2), 1600.0), (swept(4, 1), 400.0)):
        found = build_model(scene(**fields(**file_of(5)) | {"accuracy": accuracy})).settling
        assert found is not None and (found.rate, found.queue) == (rate, 5)
    explicit = fields(**file_of(5)) | {"accuracy": {"integrator": "leapfrog", "per_tick": 1000}}
    assert build_model(scene(**explicit)).settling is None
