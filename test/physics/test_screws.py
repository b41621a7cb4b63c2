# SPDX-License-Identifier: Apache-2.0
"""Infeed screws: the acceleration of their pitch law, pitch and rate of bottles behind them, and equal bits."""

from pathlib import Path

import numpy as np
import pytest
from wheel_lines import FAST, FIRST_PITCH, LAST_PITCH, RATE, SCREW_END, SCREW_START, screw_line

from conveyor_sim.simulation import Simulation

ACCELERATION = (LAST_PITCH**2 - FIRST_PITCH**2) / (2.0 * (SCREW_END - SCREW_START)) * RATE**2
"""m/s^2: that of the pitch law."""


def paths(sim: Simulation, ticks: int) -> dict[int, np.ndarray]:
    """Return time, x, vx of each bottle over some ticks, (k, 3) by id."""
    rows: dict[int, list[tuple[float, float, float]]] = {}
    for _ in range(ticks):
        sim.advance()
        bottles = sim.bottles()
        for id, x, vx in zip(bottles.id.tolist(), bottles.x.tolist(), bottles.vx.tolist(), strict=True):
            rows.setdefault(id, []).append((sim.time, x, vx))
    return {id: np.array(own) for id, own in rows.items()}


def test_bottles_have_the_acceleration_of_the_pitch_law() -> None:
    """A belt faster than the screw keeps bottles at the thread: v^2 grows by 2 a per metre, within 1 %.

    Bottles that can move in the thread would deviate by their play.
    """
    sim = screw_line(speed=FAST, play=1e-4)
    sim.advance(200)
    through = [path for path in paths(sim, 300).values() if path[0, 1] < SCREW_START and path[-1, 1] > SCREW_END]
    assert len(through) >= 8
    for path in through:
        inside = path[(path[:, 1] > SCREW_START + 0.1) & (path[:, 1] < SCREW_END - 0.02)]
        slope = np.polyfit(inside[:, 1], inside[:, 2] ** 2, 1)[0]
        assert 0.5 * slope == pytest.approx(ACCELERATION, rel=0.01)


def test_bottles_leave_at_the_last_pitch_and_the_rate_of_the_axis() -> None:
    """A belt at the last pitch times the rate keeps the distances that the screw has made, one bottle per turn."""
    sim = screw_line(speed=LAST_PITCH * RATE)
    sim.advance(300)
    sim.advance(round(20.0 / RATE / sim.scene.tick))
    x = np.sort(sim.bottles().x)
    behind = x[x > SCREW_END + 0.01]
    assert behind.size >= 3
    assert np.diff(behind) == pytest.approx(LAST_PITCH, rel=0.01)
    assert np.median(sim.bottles().vx[sim.bottles().x > SCREW_END]) == pytest.approx(LAST_PITCH * RATE, rel=0.01)


def test_results_have_equal_bits_with_threads_and_after_checkpoints(tmp_path: Path) -> None:
    """The state after a few seconds is that of one uninterrupted run on one thread."""
    runs = [screw_line(speed=FAST, threads=threads) for threads in (1, 2)]
    for sim in runs:
        sim.advance(150)
    runs[1].save(tmp_path / "half_way.checkpoint")
    runs.append(Simulation.load(tmp_path / "half_way.checkpoint"))
    for sim in runs:
        sim.advance(150)
    assert len({sim.state_hash() for sim in runs}) == 1
