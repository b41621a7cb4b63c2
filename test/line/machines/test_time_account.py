# SPDX-License-Identifier: Apache-2.0
"""Times by category, summed at changes only."""

from __future__ import annotations

import numpy as np
import pytest

from conveyor_sim.line.machines.efficiency import CATEGORIES, TimeAccount
from conveyor_sim.physics.state.snapshot import restore, snapshot


def test_every_tick_is_in_one_category() -> None:
    account = TimeAccount("idle", 2.0)
    account.change(10, "running")
    account.change(10, "starved")
    account.change(25, "running")
    account.change(30, "running")
    assert account.up_to(40) == {"running": 15, "starved": 15, "blocked": 0, "down": 0, "planned": 0, "idle": 10}
    assert account.up_to(41)["running"] == 16  # and looking changes nothing


def test_sums_are_those_of_a_look_at_every_tick() -> None:
    """Changes are random, also several within a tick; the last one of a tick counts from that tick on."""
    draw = np.random.default_rng(3)
    account = TimeAccount("running", 2.0)
    seen = dict.fromkeys(CATEGORIES, 0)
    for tick in range(1, 2000):
        seen[account.category] += 1
        for _ in range(draw.integers(0, 3)):
            account.change(tick, CATEGORIES[draw.integers(len(CATEGORIES))])
        assert account.up_to(tick) == seen


def test_work_at_the_set_rate_is_that_of_a_look_at_every_tick() -> None:
    """Rate and category change at random; a rate counts from its tick on, in ticks charged as running."""
    draw = np.random.default_rng(4)
    account, work = TimeAccount("running", 2.0), 0.0
    for tick in range(1, 2000):
        work += account.rate if account.category == "running" else 0.0
        if draw.random() < 0.1:
            account.change_rate(tick, float(draw.integers(0, 5)))
        account.change(tick, CATEGORIES[draw.integers(len(CATEGORIES))])
        assert account.set_work_up_to(tick) == work


def test_an_account_goes_on_from_a_checkpoint() -> None:
    account, other = TimeAccount("running", 2.0), TimeAccount("idle", 2.0)
    account.change(5, "blocked")
    restore(other, snapshot(account))
    for each in (account, other):
        each.change(9, "running")
    assert other.up_to(12) == account.up_to(12)
    with pytest.raises(ValueError, match="ticks"):
        restore(other, {**snapshot(account), "ticks": {"running": 1}})
    with pytest.raises(ValueError, match="category"):
        restore(other, {**snapshot(account), "category": "asleep"})
