# SPDX-License-Identifier: Apache-2.0
"""Queues of a run with impulses: chains of touching bottles, and contacts whose forces had no time to settle."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scenes import scene
from swept import fields, file_of, run

from conveyor_sim.report.outline import outline_unrecorded
from conveyor_sim.report.summarize import summarize
from conveyor_sim.run.force_check import PeakWatch
from conveyor_sim.run.queue_check import QueueCheck, QueueWatch, queues, touching
from conveyor_sim.run.runner import run_scene


def test_bottles_touch_within_their_reach_in_any_order() -> None:
    """Against all distances, for bottles of two sizes at random places."""
    random = np.random.default_rng(3)
    x, y = random.uniform(0.0, 1.0, (2, 300))
    radius = np.where(random.uniform(size=300) < 0.5, 0.03, 0.05)
    a, b = touching(x, y, radius)
    found = {tuple(sorted(pair)) for pair in zip(a.tolist(), b.tolist(), strict=True)}
    distance = np.hypot(x[:, None] - x, y[:, None] - y)
    close = np.triu(distance <= 1.002 * (radius[:, None] + radius), 1)
    assert found == set(zip(*(side.tolist() for side in np.nonzero(close)), strict=True))
    assert len(found) == a.size > 100


def test_a_queue_is_the_longest_way_through_a_cluster() -> None:
    """A file of seven with a branch of two, a pair, and two bottles alone."""
    links = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (5, 6), (3, 7), (7, 8), (9, 10)]
    a, b = np.array(links).T
    assert sorted(queues(13, a, b)) == [(2, 1), (7, 8)]
    ring = [(n, (n + 1) % 8) for n in range(8)]
    assert queues(8, *np.array(ring).T) == [(5, 8)]


@pytest.mark.parametrize(("steps", "sweeps", "trusted"), [(4, 1, False), (16, 2, True)])
def test_a_run_reports_the_contacts_of_a_queue_that_is_too_long(steps: int, sweeps: int, trusted: bool) -> None:
    sim = run(steps, sweeps, **file_of(30), outputs={"bottles": 50}, duration=2.0)
    watch = PeakWatch(sim)
    for _ in range(150):
        sim.advance()
        watch.after_tick()
    check, settling = watch.queue, sim.model.settling
    assert check is not None and settling is not None
    assert (check.bottles, check.contacts) == (30, 29)
    assert check.seconds == settling.seconds(30)
    assert check.beyond == (0 if trusted else 29)
    if trusted:
        assert check.warning == ""
    else:
        assert check.seconds > 4.0 and check.longest == settling.longest < 30
        assert "29 of 29 contacts" in check.warning and "a queue of 30 bottles" in check.warning


def test_bottles_that_touch_nothing_are_no_queue() -> None:
    sim = run(**file_of(5, gap=0.05), outputs={"bottles": 50}, duration=1.0)
    watch = QueueWatch(sim.model)
    sim.advance(2)
    watch.take(0.0, sim.bottles())
    assert watch.check == QueueCheck(0, 0.0, watch.check.seconds, watch.check.longest, 0, 0)  # type: ignore[union-attr]
    assert watch.check is not None and not watch.check.warning and not watch.check.peak_note


def test_the_outline_of_a_run_warns_recorded_or_not(tmp_path: Path) -> None:
    given = fields(4, 1, **file_of(30)) | {"outputs": {"bottles": 50}, "duration": 1.5}
    made = scene(**given)
    unrecorded = run_scene(made, None)
    lines = outline_unrecorded(made.name, unrecorded, (), ())
    assert any("can't be trusted" in line and "a queue of 30" in line for line in lines)
    assert any("peaks of impacts on pressed contacts are not resolved" in line for line in lines)
    recorded = run_scene(made, tmp_path / "bag")
    assert recorded.queue == unrecorded.queue
    assert recorded.queue is not None
    # A recording begins with the start, so that it is looked at earlier in each second.
    assert summarize(tmp_path / "bag").queue == replace(recorded.queue, time=1.0)


def test_other_integrators_have_no_queue_check() -> None:
    explicit = fields(**file_of(3)) | {
        "accuracy": {"integrator": "leapfrog", "per_tick": 1200}, "outputs": {"bottles": 50}, "duration": 0.02,
    }  # fmt: skip
    assert run_scene(scene(**explicit), None).queue is None
