# SPDX-License-Identifier: Apache-2.0
"""Points of studies: all combinations, lists, and samples that are spread as they should be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from studies.small import setup_of

from conveyor_sim.studies.design import points_of, saltelli

RANGES = {
    "rate": {"argument": "rate", "low": 2.0, "high": 8.0, "log": True},
    "count": {"argument": "count", "low": 1, "high": 4, "whole": True},
}
VALUES = {"rate": {"argument": "rate", "values": [4.0, 6.0]}, "g": {"field": "gravity", "values": [9.7, 9.8]}}


def test_a_grid_has_all_combinations_and_a_list_the_pairs(tmp_path: Path) -> None:
    grid = points_of(setup_of(tmp_path, parameters=VALUES).study)
    assert [tuple(point.values()) for point in grid] == [(4.0, 9.7), (4.0, 9.8), (6.0, 9.7), (6.0, 9.8)]
    pairs = points_of(setup_of(tmp_path, parameters=VALUES, design="list").study)
    assert [tuple(point.values()) for point in pairs] == [(4.0, 9.7), (6.0, 9.8)]


@pytest.mark.parametrize("design", ["latin_hypercube", "sobol"])
def test_samples_fill_every_part_of_a_range_equally(tmp_path: Path, design: str) -> None:
    study = setup_of(tmp_path, parameters=RANGES, design=design, points=16).study
    points = points_of(study)
    parts = np.floor(16 * np.log(np.array([point["rate"] for point in points]) / 2.0) / np.log(4.0)).astype(int)
    assert sorted(parts) == list(range(16))  # one in each sixteenth, by ratio
    counts = [point["count"] for point in points]
    assert all(isinstance(count, int) for count in counts)
    assert np.bincount(counts).tolist() == [0, 4, 4, 4, 4]
    assert points == points_of(study)
    assert points != points_of(study.model_copy(update={"design_seed": 1}))
    # The first of more points of Sobol's sequence are the same: a study can be extended.
    more = points_of(study.model_copy(update={"points": 32}))
    assert (more[:16] == points) == (design == "sobol")


def test_indices_need_a_design_of_their_own() -> None:
    pytest.importorskip("SALib")
    shares = saltelli(["a", "b", "c"], 8, 0)
    assert shares.shape == (8 * 5, 3)
    assert ((shares >= 0.0) & (shares <= 1.0)).all()
