# SPDX-License-Identifier: Apache-2.0
"""Efficiency from times and bottles, against numbers worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from conveyor_sim.line.machines.efficiency import CATEGORIES, DEFINITIONS, CycleSums, Efficiency, busy, efficiency

SHIFT = {"running": 300.0, "starved": 60.0, "blocked": 20.0, "down": 100.0, "planned": 100.0, "idle": 20.0}
"""s, of 600."""


MADE = CycleSums(cycles=540.0, set_cycles=570.0, rate=2.0, good=480, made=540, failures=4)


def test_a_shift_by_hand() -> None:
    """A machine of at most 2 bottles/s, planned for 500 s, that ran for 300 s at 1.8 of 1.9 bottles/s, one in nine bad,
    and failed 4 times."""
    made = efficiency(SHIFT, MADE)
    assert busy(SHIFT) == 500.0
    assert made == Efficiency(
        availability=pytest.approx(300 / 500),
        effectiveness=pytest.approx(540 / 600),
        set_effectiveness=pytest.approx(540 / 570),
        quality=pytest.approx(480 / 540),
        mtbf=75.0,
        mttr=25.0,
    )
    assert made.oee == pytest.approx(480 / (2.0 * 500))  # good bottles against what it would make, running all the time


def test_what_is_not_known_yet_is_no_number() -> None:
    """At the start, and for a machine that has not failed."""
    fresh = efficiency(dict.fromkeys(CATEGORIES, 0.0), CycleSums(0.0, 0.0, 2.0, 0, 0, 0))
    assert all(
        math.isnan(value) for value in (fresh.availability, fresh.effectiveness, fresh.quality, fresh.oee, fresh.mttr)
    )
    assert math.isnan(fresh.mtbf)
    sound = efficiency(SHIFT | {"down": 0.0}, replace(MADE, failures=0))
    assert sound.mtbf == math.inf
    assert math.isnan(sound.mttr)


def test_planned_stops_cost_no_availability() -> None:
    longer = efficiency(SHIFT | {"planned": 900.0}, MADE)
    assert longer == efficiency(SHIFT, MADE)


def test_each_figure_has_its_definition() -> None:
    names = {"busy", "oee", *Efficiency.__dataclass_fields__}
    assert names == set(DEFINITIONS)
    assert all(DEFINITIONS.values())
