# SPDX-License-Identifier: Apache-2.0
"""Times by category, summed at changes only."""

from __future__ import annotations

import numpy as np
import pytest

from conveyor_sim.line.machines.efficiency import CATEGORIES, TimeAccount
from conveyor_sim.physics.state.snapshot import restore, snapshot


def test_every_tick_is_in_one_category() -> None:
    account = TimeAccount("idle")
    account.change(10, "running")
    account.change(10, "starved")
    account.change(25, "running")
    account.change(30, "running")
    assert account.up_to(40) == {"running": 15, "starved": 15, "blocked": 0, "down": 0, "planned": 0, "idle": 10}
    assert account.up_to(41)["running"] == 16  # and looking changes nothing


def test_sums_are_those_of_a_look_at_every_tick() -> None:
    """Changes are random, also several within a tick; the last one of a tick counts from that tick on."""
    draw = np.random.default_rng(3)
    account = TimeAccount("running")
    seen = dict.fromkeys(CATEGORIES, 0)
    for tick in range(1, 2000):
        seen[account.category] += 1
        for _ in range(draw.integers(0, 3)):
            account.change(tick, CATEGORIES[draw.integers(len(CATEGORIES))])
        assert account.up_to(tick) == seen


def test_a_reset_begins_anew_with_what_goes_on() -> None:
    account = TimeAccount("running")
    account.change(5, "down")
    account.reset(8)
    assert account.up_to(11) == {**dict.fromkeys(CATEGORIES, 0), "down": 3}
    account.change(12, "running")
    assert account.up_to(20) == {**dict.fromkeys(CATEGORIES, 0), "down": 4, "running": 8}


def test_an_account_goes_on_from_a_checkpoint() -> None:
    account, other = TimeAccount("running"), TimeAccount("idle")
    account.change(5, "blocked")
    restore(other, snapshot(account))
    for each in (account, other):
        each.change(9, "running")
    assert other.up_to(12) == account.up_to(12)
    with pytest.raises(ValueError, match="ticks"):
        restore(other, {**snapshot(account), "ticks": {"running": 1}})
    with pytest.raises(ValueError, match="category"):
        restore(other, {**snapshot(account), "category": "asleep"})
