# SPDX-License-Identifier: Apache-2.0
"""The scenes that are timed are what the tables say of them."""

from pathlib import Path

import numpy as np
import pytest

from bench import growth, ours
from bench.packed import EFFECTS, LONGEST, PITCH, box_for, table
from bench.rows import Row, Rows


@pytest.mark.parametrize("count", [10, 100, 1_000, 10_000, 100_000])
def test_a_box_is_two_to_one_and_holds_all(count: int) -> None:
    box = box_for(count)
    assert sum(box.row(i)[2] for i in range(box.rows)) == count
    assert box.length <= LONGEST
    if box.length < LONGEST:
        assert box.length / box.width == pytest.approx(2.0, abs=3.0 * PITCH / box.width)
    assert box.row(box.rows - 1)[0] > PITCH / 2  # the last row stands within the box


@pytest.mark.parametrize("effects", EFFECTS)
def test_a_table_has_its_bottles(effects: str) -> None:
    simulation = ours.simulate(table(100, effects), threads=1)
    assert simulation.counts.present - simulation.counts.fed == 100


@pytest.mark.parametrize("belts, rails", [(1, 1), (100, 1), (1, 100)])
def test_files_touch_the_same_however_belts_and_rails_are_divided(belts: int, rails: int) -> None:
    """Each file presses on the stop with both bottles: one contact each with the stop and between them, no others."""
    simulation = ours.simulate(growth.files(belts, rails, 1.0), threads=1)
    simulation.advance(20)
    contacts = simulation.contacts()
    assert (len(simulation.model.belts), len(simulation.model.rails)) == (belts, rails)
    assert np.bincount(contacts.kind).tolist() == [growth.FILES, growth.FILES]
    assert (contacts.normal_force > 0.0).all()


@pytest.mark.parametrize("share", [0.0, 0.25])
def test_the_share_that_touches_is_the_one_asked_for(share: float) -> None:
    simulation = ours.simulate(growth.files(1, 1, share), threads=1)
    simulation.advance(50)
    contacts = simulation.contacts()
    touching = np.unique(np.concatenate([contacts.a, contacts.b[contacts.kind == 0]]))
    assert touching.size == share * simulation.counts.present


def test_rows_come_back_as_they_were_written(tmp_path: Path) -> None:
    rows = Rows([Row("dense", 100.0, "a", "rate", i, 0.1 + i) for i in range(3)])
    path = tmp_path / "rows.csv"
    rows.write(path)
    assert Rows.read(path).all == rows.all


def test_a_ratio_is_taken_round_by_round() -> None:
    """A machine that halves its speed after a round changes no ratio."""
    values = {"fast": (8.0, 4.0), "slow": (2.0, 1.0)}
    rows = Rows([Row("c", 1.0, who, "rate", i, value) for who, both in values.items() for i, value in enumerate(both)])
    found = rows.ratio("c", 1.0, "fast", "slow", "rate")
    assert found is not None
    assert (found.middle, found.least, found.greatest) == (4.0, 4.0, 4.0)
