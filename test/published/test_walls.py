# SPDX-License-Identifier: Apache-2.0
"""Column of discs between walls on a belt, as in Karim and Corwin (2014), with few runs."""

import pytest
from published.studies import module

STUDY = module("karim_corwin_2014")


def share(walls: str, model: str, discs: int) -> float:
    """Return the share of the drag that the stop bears, in one packing."""
    case = {"place": walls, "model": model, "discs": discs, "seed": 1}
    found: float = STUDY.simulate(case)["share"]
    return found


def test_with_the_friction_curve_straight_walls_carry_nothing() -> None:
    assert share(STUDY.STRAIGHT, STUDY.CURVE, 50) == pytest.approx(1.0, abs=0.03)


def test_springs_carry_a_part_of_a_long_column_and_vibration_relaxes_them() -> None:
    """A sawtooth carries more, whether the chain vibrates or not."""
    straight = share(STUDY.STRAIGHT, STUDY.SPRINGS, 200)
    shaken = share(STUDY.STRAIGHT, STUDY.SHAKEN, 200)
    assert straight < 0.85
    assert straight + 0.1 < shaken < 0.98
    assert share(STUDY.TOOTHED, STUDY.SPRINGS, 200) < straight - 0.15
    assert share(STUDY.TOOTHED, STUDY.SHAKEN, 200) < shaken - 0.15


def test_springs_between_discs_and_the_curve_at_walls_give_both_results() -> None:
    """Straight walls carry nothing, and an outlet of 2.5 d jams."""
    assert share(STUDY.STRAIGHT, STUDY.MIXED, 200) == pytest.approx(1.0, abs=0.05)
    assert [STUDY.jams(STUDY.MIXED, seed) for seed in (1, 2)] == [True, True]
