# SPDX-License-Identifier: Apache-2.0
"""State bars, stop reasons and efficiency are drawn as they were."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from conveyor_sim.columns.counters import CounterColumns
from conveyor_sim.line.machines.efficiency import CATEGORIES
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.production import (
    COLOURS,
    MOST,
    efficiency_figure,
    state_bars_figure,
    stop_reasons_figure,
)
from conveyor_sim.report.periods import Period, longest_stops, shares, stop_reasons

FILLER = [
    Period("machines/filler", 0.0, 40.0, "running", ""),
    Period("machines/filler", 40.0, 50.0, "down", "failure jam"),
    Period("machines/filler", 50.0, 70.0, "running", ""),
    Period("machines/filler", 70.0, 75.0, "blocked", "blocked"),
    Period("machines/filler", 75.0, 80.0, "down", "failure jam"),
    Period("machines/filler", 80.0, 100.0, "running", ""),
]
PACKER = [
    Period("machines/packer", 0.0, 30.0, "starved", "starved"),
    Period("machines/packer", 30.0, 100.0, "running", ""),
]


@pytest.fixture(autouse=True)
def look() -> Iterator[None]:
    with style.look():
        yield


def counters(rates: tuple[float, ...] = (2.0, 2.5), **given: Any) -> CounterColumns:
    """Of a filler, a packer and a line whose bottleneck is the filler."""
    names = ("machines/filler", "machines/packer", "line")
    columns: dict[str, Any] = {field: np.zeros(3) for field in CounterColumns.__dataclass_fields__}
    texts = {"name": names, "category": ("running", "starved", ""), "stop_reason": ("", "starved", "")}
    chosen = {"rate_limit": np.array([*rates, rates[0]]), "bottleneck": names[:1]}
    return CounterColumns(**columns | texts | chosen | given)


def test_reasons_are_summed_and_stops_sorted() -> None:
    reasons = stop_reasons([*FILLER, *PACKER])
    assert [(entry.machine, entry.why, entry.stops, entry.length) for entry in reasons] == [
        ("machines/packer", "starved", 1, 30.0),
        ("machines/filler", "failure jam", 2, 15.0),
        ("machines/filler", "blocked", 1, 5.0),
    ]
    assert [stop.length for stop in longest_stops([*FILLER, *PACKER], 3)] == [30.0, 10.0, 5.0]


def test_shares_are_those_of_the_time() -> None:
    """Of intervals that begin and end anywhere; they add up to 1 where the machine is known."""
    edges = np.array([0.0, 35.0, 45.0, 77.0, 100.0, 120.0])
    found = shares(FILLER, CATEGORIES, edges)
    running, down = found[CATEGORIES.index("running")], found[CATEGORIES.index("down")]
    np.testing.assert_allclose(running, [1.0, 0.5, 20 / 32, 20 / 23, 0.0])
    np.testing.assert_allclose(down, [0.0, 0.5, 7 / 32, 3 / 23, 0.0])
    np.testing.assert_allclose(found.sum(axis=0), [1.0, 1.0, 1.0, 1.0, 0.0])


def test_a_bar_shows_a_machine_at_each_moment() -> None:
    """The colour at the middle of each period, in the picture itself."""
    periods = {"machines/filler": FILLER, "machines/packer": PACKER}
    figure = state_bars_figure(periods, 0.0, 100.0, "line")
    pixels, (ax,) = drawn(figure), figure.axes
    assert [label.get_text() for label in ax.get_yticklabels()] == ["filler", "packer"]
    for row, machine in enumerate(periods.values()):
        for period in machine:
            x, y = ax.transData.transform(((period.begin + period.end) / 2, row))
            expected = np.array([int(COLOURS[period.category][at : at + 2], 16) for at in (1, 3, 5)])
            assert np.abs(pixels[len(pixels) - 1 - int(y), int(x), :3].astype(int) - expected).max() <= 2, period


def test_categories_differ_in_colour_and_none_is_forgotten() -> None:
    assert set(COLOURS) == set(CATEGORIES)
    assert len(set(COLOURS.values())) == len(CATEGORIES)


def test_bars_of_reasons_are_as_long_as_the_stops() -> None:
    figure = stop_reasons_figure(stop_reasons([*FILLER, *PACKER]), "line")
    bars, share = figure.axes
    assert [patch.get_width() for patch in bars.patches] == [30.0, 15.0, 5.0]
    assert [label.get_text() for label in bars.get_yticklabels()] == [
        "packer: starved",
        "filler: failure jam",
        "filler: blocked",
    ]
    np.testing.assert_allclose(share.lines[0].get_xdata(), [60.0, 90.0, 100.0])


def test_what_is_beyond_the_first_reasons_is_one_bar() -> None:
    many = [Period("machines/filler", 10.0 * n, 10.0 * n + 1 + n / 10, "down", f"failure {n}") for n in range(MOST + 5)]
    bars = stop_reasons_figure(stop_reasons(many), "line").axes[0]
    widths = [patch.get_width() for patch in bars.patches]
    assert len(widths) == MOST + 1
    assert sum(widths) == pytest.approx(sum(period.length for period in many))


def test_a_line_without_stops_can_be_drawn() -> None:
    assert drawn(stop_reasons_figure([], "line")).size
    assert drawn(state_bars_figure({"machines/filler": FILLER[:1]}, 0.0, 0.0, "line")).size


def test_the_line_is_drawn_against_its_bottleneck() -> None:
    """One good bottle a second where the filler makes two: 3600 an hour against 7200."""
    time = np.arange(0.0, 401.0)
    figure = efficiency_figure(counters(oee=np.array([0.6, 0.4, 0.5])), time, time, "line")
    over_time, factors = figure.axes
    (bottleneck,) = [line for line in over_time.lines if line.get_gid() == "bottleneck"]
    assert list(bottleneck.get_ydata()) == [7200.0, 7200.0]
    (made,) = [patch for patch in over_time.patches if patch.get_gid() == "made"]
    np.testing.assert_allclose(made.get_data().values, 3600.0)
    assert "50.0 %" in over_time.get_title(loc="left")
    oee = [patch.get_width() for patch in factors.patches if patch.get_gid() == "oee"]
    np.testing.assert_allclose(oee, [60.0, 40.0])


def drawn(figure: Figure) -> np.ndarray:
    canvas: Any = figure.canvas
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())
