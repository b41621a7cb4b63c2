# SPDX-License-Identifier: Apache-2.0
"""Counts, rates and forces over time are drawn as recorded."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Flow, PeakForceSeries
from conveyor_sim.report.figures.flow import entries_per_minute, flow_figure, force_figure, rate_window

TIME = np.arange(0, 1001) * 0.02


@pytest.fixture(autouse=True)
def look() -> Iterator[None]:
    with style.look():
        yield


def flow() -> Flow:
    fed = np.minimum((TIME * 4.0).astype(np.int64), 50)
    removed = np.maximum(fed - 30, 0)
    on_belt = np.stack([np.minimum(fed, 20), np.maximum(fed - 20, 0) - removed], axis=1)
    entered = np.stack([fed, np.maximum(fed - 20, 0)], axis=1)
    return Flow(TIME, fed, removed, np.zeros_like(fed), fed - removed, on_belt, entered)


def line(figure: Figure, gid: str) -> Line2D:
    (found,) = [line for ax in figure.axes for line in ax.lines if line.get_gid() == gid]
    return found


def stepped(drawn: Line2D, time: np.ndarray) -> np.ndarray:
    """What a curve that steps after its points shows at `time`."""
    assert drawn.get_drawstyle() == "steps-post"
    at, level = np.asarray(drawn.get_xdata()), np.asarray(drawn.get_ydata())
    return level[np.searchsorted(at, time, side="right") - 1]


def test_counts_drawn_are_the_counts_recorded() -> None:
    recorded = flow()
    figure = flow_figure(recorded, ["feeder", "table"])
    for name, values in (("fed", recorded.fed), ("on the line", recorded.present), ("removed", recorded.removed)):
        np.testing.assert_array_equal(stepped(line(figure, name), TIME), values)
    np.testing.assert_array_equal(stepped(line(figure, "feeder on"), TIME), recorded.on_belt[:, 0])
    np.testing.assert_array_equal(stepped(line(figure, "table on"), TIME), recorded.on_belt[:, 1])


def test_the_legend_tells_the_counts_at_the_end() -> None:
    legend = flow_figure(flow(), ["feeder", "table"]).axes[0].get_legend()
    assert [text.get_text() for text in legend.get_texts()] == [
        "fed (50 at the end)",
        "on the line (30 at the end)",
        "removed (20 at the end)",
    ]


def test_rates_drawn_are_the_entries_over_the_window() -> None:
    recorded = flow()
    drawn = line(flow_figure(recorded, ["feeder", "table"]), "feeder in")
    rates = entries_per_minute(TIME, recorded.entered, rate_window(TIME))
    np.testing.assert_array_equal(stepped(drawn, TIME), rates[:, 0])


def test_a_steady_feed_of_four_a_second_is_240_per_minute() -> None:
    rates = entries_per_minute(TIME, flow().entered, 2.0)
    assert rates[500, 0] == pytest.approx(240.0)
    assert rates[0, 0] == 0.0
    assert rates[-1, 0] == 0.0


def test_entries_before_the_window_has_passed_once_are_counted_in_full() -> None:
    entered = np.array([[1], [1], [2]])
    np.testing.assert_allclose(entries_per_minute(np.array([0.0, 0.5, 1.0]), entered, 2.0)[:, 0], [30.0, 30.0, 60.0])


def test_a_line_without_belts_and_signals_has_the_bottles_on_it_drawn() -> None:
    recorded = flow()
    bare = Flow(TIME, None, None, None, recorded.present, np.empty((1001, 0)), np.empty((1001, 0)))
    figure = flow_figure(bare, [])
    assert [drawn.get_gid() for drawn in figure.axes[0].lines] == ["on the line"]


def test_a_recording_of_one_instant_is_drawn() -> None:
    zero, one = np.zeros(1, dtype=np.int64), np.zeros((1, 1), dtype=np.int64)
    figure = flow_figure(Flow(np.zeros(1), zero, zero, zero + 1, zero, one, one), ["feeder"])
    assert len(figure.axes) == 3
    assert len(force_figure(PeakForceSeries(np.zeros(1), np.zeros(1), np.zeros(1), zero - 1)).axes) == 1


def test_forces_drawn_are_the_forces_recorded() -> None:
    largest = 50.0 + 40.0 * np.sin(TIME)
    force = PeakForceSeries(TIME, largest, 0.5 * largest, np.full(1001, 7))
    figure = force_figure(force)
    np.testing.assert_array_equal(line(figure, "largest").get_ydata(), largest)
    np.testing.assert_array_equal(line(figure, "percentile_99").get_ydata(), 0.5 * largest)
    assert figure.axes[0].get_ylabel() == "peak contact force (N)"


def test_the_hardest_impact_is_told_with_its_bottle_and_time() -> None:
    largest = np.ones(1001)
    largest[100] = 123.4
    figure = force_figure(PeakForceSeries(TIME, largest, np.ones(1001), np.where(largest > 1.0, 42, 0)))
    assert [text.get_text() for text in figure.axes[0].texts] == ["123 N, bottle 42, 2.00 s"]
