# SPDX-License-Identifier: Apache-2.0
"""Lines along the bins of rails, and the names of the machines that bear most."""

import math

import numpy as np
import pytest
from scenes import bottle, contact, scene

from conveyor_sim.columns.damage import RailWearColumns
from conveyor_sim.report.figures.damage import bin_lines, rails_figure
from conveyor_sim.report.figures.data import Damage, StaticGeometry


def wear(*bins: tuple[int, float, float, float], work: float = 1.0) -> RailWearColumns:
    """Return columns of bins (rail, x, y, length)."""
    rail, x, y, length = (np.array(column) for column in zip(*bins, strict=True))
    return RailWearColumns(rail.astype(np.uint32), x, y, length, np.full(len(bins), work), np.ones(len(bins)))


def test_lines_end_halfway_to_neighbours_of_the_same_rail() -> None:
    """Two bins of a rail, one of another in line with them, one far away, and two around a corner."""
    lines = bin_lines(
        wear((0, 0.0, 0.0, 0.1), (0, 0.1, 0.0, 0.1), (1, 0.2, 0.0, 0.1), (1, 5.0, 0.0, 0.1), (2, 0.0, 1.0, 0.1),
             (2, 0.05, 1.05, 0.1))
    )  # fmt: skip
    expected = [
        [[-0.05, 0.0], [0.0, 0.0], [0.05, 0.0]],
        [[0.05, 0.0], [0.1, 0.0], [0.15, 0.0]],
        [[0.2, 0.0]] * 3,
        [[5.0, 0.0]] * 3,
    ]
    assert np.array(lines[:4]) == pytest.approx(np.array(expected))
    slanted = 0.05 * math.sqrt(0.5)
    assert lines[4] == pytest.approx(np.array([[-slanted, 1.0 - slanted], [0.0, 1.0], [slanted, 1.0 + slanted]]))


def test_machine_that_bears_most_is_named() -> None:
    """Rail numbers count machines, also those whose body is absent."""
    gate = {"from": [0.5, -0.1], "to": [0.5, 0.1], "material": "glass", "max_speed": 1.0, "acceleration": 8.0}
    lifted = {"kind": "lift", **gate, "stroke": 0.2, "open": True}
    pusher = {**gate, "from": [0.8, -0.1], "to": [0.8, 0.1], "direction": 0.0, "stroke": 0.1}
    geometry = StaticGeometry.of(
        scene(bottles=[bottle(0.0, 0.0)], contacts=[contact(5e3)], gates={"g": lifted}, pushers={"p": pusher})
    )
    damage = Damage(1.0, wear((0, 0.5, 0.0, 0.05), (1, 0.8, 0.0, 0.04)), 1, {}, {})
    figure = rails_figure(geometry, damage, "two machines")
    assert ["pushers/p" in ax.get_title() for ax in figure.axes[:2]] == [True, True]
