# SPDX-License-Identifier: Apache-2.0
"""Counters by direction, and zones."""

from __future__ import annotations

import numpy as np
import pytest
from line.devices.eye_line import across, eye_line, read
from scenes import base, belt, bottle, kind, simulation

RUN = "belts/belt/cmd_speed"


def test_counters_count_by_direction_and_there_and_back() -> None:
    """Three bottles pass two lines of opposite directions. Then the belt moves back under them."""
    lines = {"there": across(0.3), "turned": {"from": [0.3, 0.2], "to": [0.3, -0.2]}, "beside": across(0.3, -0.1)}
    lines["short"] = {"from": [0.3, 0.01], "to": [0.3, 0.2]}
    sim = eye_line(xs=(0.0, -0.2, -0.4), counters=lines)
    sim.advance(150)
    assert read(sim, "counters/there/") == {"forward": 3.0, "backward": 0.0}
    assert read(sim, "counters/turned/") == {"forward": 0.0, "backward": 3.0}
    assert read(sim, "counters/short/") == {"forward": 0.0, "backward": 0.0}
    assert read(sim)["belts/belt/bottles"] == 4.0
    sim.command([RUN], [-0.5])
    sim.advance(170)
    assert read(sim, "counters/there/") == {"forward": 3.0, "backward": 3.0}
    assert read(sim, "counters/turned/") == {"forward": 3.0, "backward": 3.0}


def test_a_bottle_that_begins_on_the_line_is_past_it_and_rest_is_no_passage() -> None:
    """Rounding may put the position on either side. Only the way back over the line counts."""
    places = (0.1, 0.7, 1.3)
    sim = eye_line(0.0, xs=places, counters={f"c{n}": across(x) for n, x in enumerate(places)})
    sim.advance(20)
    sim.command([RUN], [0.4])
    sim.advance(30)
    assert not any(read(sim, "counters/").values())
    sim.command([RUN], [-0.4])
    sim.advance(60)
    for n in range(3):
        assert read(sim, f"counters/c{n}/") == {"forward": 0.0, "backward": 1.0}


def test_zones_count_axes_and_divide_by_their_area() -> None:
    """An L-shaped zone of 0.75 m^2. Its switch is on from four bottles on. Its count can be falsified by a fault."""
    corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.5, 0.5], [0.5, 1.0], [0.0, 1.0]]
    places = [(0.1, 0.1), (0.9, 0.4), (0.4, 0.9), (0.2, 0.6), (0.6, 0.6), (-0.01, 0.5), (0.7, 0.2)]
    sim = eye_line(
        0.0,
        bottles=[bottle(*place) for place in places],
        zones={"l": {"region": corners, "full_at": 6}, "r": {"region": corners[::-1]}},
    )
    assert read(sim, "zones/r/") == {"bottles": 5.0, "density": pytest.approx(5.0 / 0.75)}
    assert read(sim, "zones/l/") == {"bottles": 5.0, "density": pytest.approx(5.0 / 0.75), "full": 0.0}
    for offset, shown in ((1.0, 6.0), (-2.0, 3.0), (-100.0, 0.0), (0.0, 5.0)):
        sim.inject("zones/l/offset", offset)
        sim.advance()
        assert read(sim, "zones/l/") == {
            "bottles": shown, "density": pytest.approx(shown / 0.75), "full": float(shown >= 6.0)
        }  # fmt: skip
    sim.inject("zones/l/offset", 0.5)
    sim.advance()
    assert not sim.take_outcomes()[-1].accepted


def test_ten_bottles_a_tick_are_ten() -> None:
    """Ten bottles side by side pass in one tick."""
    rank = [bottle(-0.15, y, 0.5) for y in np.linspace(-0.9, 0.45, 10)]
    sim = eye_line(bottles=rank, counters={"line": across(0.0, 1.0)}, photo_eyes={"eye": across(0.0, 1.0)})
    sim.advance(60)
    assert read(sim, "counters/line/") == {"forward": 10.0, "backward": 0.0}
    assert read(sim, "photo_eyes/eye/")["edges"] == 2.0


@pytest.mark.parametrize("turned", [0.0, 0.5])
@pytest.mark.parametrize(("columns", "rows"), [(1, 1), (1, 30), (12, 9), (40, 40)])
def test_the_range_of_a_count_is_what_a_region_can_hold(columns: int, rows: int, turned: float) -> None:
    """Bottles have the densest, hexagonal pattern, with axes on the edge of the region.

    A belt of that size has the same range. The range of a narrow region is too large, because bottles beside it could
    use its area.
    """
    radius, edge = 0.03, 1e-6
    along = 2.0 * radius * (np.arange(columns)[None, :] + 0.5 * (np.arange(rows)[:, None] % 2))
    across = np.sqrt(3.0) * radius * np.arange(rows)[:, None] + 0.0 * along
    width, height = float(along.max()) + edge, float(across.max()) + edge
    corners = np.array([(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)])
    turn = np.array([[np.cos(turned), np.sin(turned)], [-np.sin(turned), np.cos(turned)]])
    sim = simulation(
        bottle_types={"bottle": kind(radius), "large": kind(0.1)},
        base=base(0.4),
        zones={"z": {"region": (corners @ turn).tolist()}},
        belts={"b": belt(0.0, (0.0, 0.0), width, height)},
    )
    most = {tag.name: tag.high for tag in sim.process_image.signals}
    for name in ("zones/z/bottles", "belts/b/bottles"):
        assert columns * rows <= most[name] <= 1.7 * columns * rows + 3
