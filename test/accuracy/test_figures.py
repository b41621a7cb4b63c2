# SPDX-License-Identifier: Apache-2.0
"""Pictures of an accuracy study show its numbers, and their texts can be read."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from accuracy.studies import BLOWN, CHOSEN, OWN, RULES, errors, failed, point, study
from facts import missing
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text

from conveyor_sim.accuracy.figures.draw import accuracy_figures, plot_accuracy
from conveyor_sim.accuracy.figures.logarithmic import logarithmic_x
from conveyor_sim.accuracy.figures.notes import Note, place_notes
from conveyor_sim.accuracy.figures.pareto import pareto_figure
from conveyor_sim.accuracy.report.pareto import front
from conveyor_sim.accuracy.results import AccuracyStudy, Point
from conveyor_sim.report.figures import style

VERDICTS = ("equivalent", "different", "undecided")


@pytest.fixture
def ax() -> Iterator[Axes]:
    with style.look():
        yield style.new_figure(6.0, 6.0).subplots()


@pytest.fixture(autouse=True)
def look() -> Iterator[None]:
    with style.look():
        yield


@pytest.fixture(scope="module")
def figures() -> dict[str, Figure]:
    """The pictures of the whole study: not to be changed."""
    with style.look():
        return accuracy_figures(study())


def lines(figure: Figure, gid: str) -> list[Line2D]:
    return [line for ax in figure.axes for line in ax.lines if line.get_gid() == gid]


def line(figure: Figure, gid: str) -> Line2D:
    (found,) = lines(figure, gid)
    return found


def points_of(drawn: Line2D) -> list[tuple[float, float]]:
    x, y = np.asarray(drawn.get_xdata(), dtype=float), np.asarray(drawn.get_ydata(), dtype=float)
    return list(zip(x.tolist(), y.tolist(), strict=True))


def place(of: Point) -> tuple[float, float]:
    """In the diagram: s/s and %."""
    assert of.cost is not None and of.errors is not None
    return of.cost.median, 100.0 * of.errors.peak_force


def panel(figure: Figure, title: str) -> Axes:
    (found,) = [ax for ax in figure.axes if ax.get_title(loc="left").startswith(title)]
    return found


def shown_texts(figure: Figure) -> list[Text]:
    """All but those of ticks outside the axes, which are not drawn."""
    hidden = []
    for ax in figure.findobj(Axes):
        for axis in (ax.xaxis, ax.yaxis):
            low, high = sorted(axis.get_view_interval())
            for tick in axis.get_major_ticks():
                hidden += [] if ax.axison and low <= tick.get_loc() <= high else [tick.label1, tick.label2]
    texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]
    return [text for text in texts if text not in hidden]


def bare() -> AccuracyStudy:
    """Nothing but failures."""
    points = tuple(failed(name, 20, BLOWN) for name in RULES)
    return replace(study(), points=points, orders=(), comparisons=(), stiffness=(), samples=(), answer=None)


def single() -> AccuracyStudy:
    """One row of everything."""
    of = study()
    return replace(
        of,
        points=(point("velocity_verlet", 100),),
        orders=of.orders[:1],
        comparisons=of.comparisons[:1],
        stiffness=of.stiffness[:1],
    )


def test_files_are_written_and_equal_studies_give_equal_bytes(tmp_path: Path) -> None:
    paths = plot_accuracy(single(), tmp_path / "one")
    names = ["pareto", "orders", "ensembles", "stiffness"]
    assert [path.name for path in paths] == [f"{name}{suffix}" for name in names for suffix in (".png", ".svg")]
    for one, other in zip(paths, plot_accuracy(single(), tmp_path / "other"), strict=True):
        assert one.read_bytes() == other.read_bytes()


def test_what_has_no_rows_has_no_picture() -> None:
    assert list(accuracy_figures(bare())) == ["pareto"]


@pytest.mark.parametrize("of", [study(), bare(), single()], ids=["whole", "bare", "single"])
def test_no_text_is_cut_off_and_none_lies_on_another(of: AccuracyStudy) -> None:
    named = "a line of bottles of glass with a funnel, an accumulation table, two loops and a turn-table, at 100 MN/m"
    for figure in accuracy_figures(replace(of, scene=named)).values():
        figure.draw_without_rendering()
        width, height = figure.canvas.get_width_height()
        extents = [(text, text.get_window_extent()) for text in shown_texts(figure)]
        for text, box in extents:
            assert min(box.x0, box.y0) >= 0.0 and box.x1 <= width and box.y1 <= height, text.get_text()
        for (one, a), (other, b) in combinations(extents, 2):
            if one.get_rotation() % 90.0 == 0.0 == other.get_rotation() % 90.0:  # of others the box says little
                assert not a.overlaps(b), f"{one.get_text()!r} and {other.get_text()!r}"


def test_every_setting_that_did_not_fail_is_a_point_at_its_cost_and_error(figures: dict[str, Figure]) -> None:
    of = study()
    figure = figures["pareto"]
    drawn = {
        place for name in (*RULES, "dormand_prince") for found in lines(figure, name) for place in points_of(found)
    }
    softened = set(points_of(line(figure, "semi_implicit_euler softened")))
    assert drawn == {place(p) for p in of.points if not p.failure and p.setting.stiffness == 1.0}
    assert softened == {place(p) for p in of.points if not p.failure and p.setting.stiffness != 1.0}


def test_a_step_beyond_a_bound_of_stability_is_a_hollow_mark_with_an_entry(figures: dict[str, Figure]) -> None:
    of = study()
    figure = figures["pareto"]
    for name in RULES:
        unstable = [p for p in of.points if p.setting.integrator == name and not p.stable and not p.failure]
        hollow = line(figure, f"{name} unstable")
        assert hollow.get_markerfacecolor() == "white"
        assert set(points_of(hollow)) == {place(p) for p in unstable if p.setting.stiffness == 1.0} != set()
        resting = line(figure, f"{name} resting unstable")
        assert resting.get_markerfacecolor() == "white"
        assert resting.get_markersize() == line(figure, f"{name} resting").get_markersize()
        assert {x for x, _ in points_of(resting)} == {x for x, _ in points_of(hollow)}
    assert any(label.startswith("hollow") for label in entries(figure))
    stable = pareto_figure(replace(of, points=tuple(p for p in of.points if p.stable)))
    assert not any("unstable" in (drawn.get_gid() or "") for ax in stable.axes for drawn in ax.lines)
    assert not any(label.startswith("hollow") for label in entries(stable))


def entries(figure: Figure) -> list[str]:
    """Texts of the legend of the diagram."""
    (legend,) = [ax.get_legend() for ax in figure.axes if ax.get_legend() is not None]
    return [text.get_text() for text in legend.get_texts()]


def test_resting_load_is_a_small_marker_at_its_error(figures: dict[str, Figure]) -> None:
    for name in RULES:
        drawn = line(figures["pareto"], f"{name} resting")
        assert drawn.get_markersize() < line(figures["pareto"], name).get_markersize()
        low = figures["pareto"].axes[0].get_ylim()[0]
        expected = {
            (p.cost.median, 100.0 * p.resting)
            for p in study().points
            if p.setting.integrator == name and p.cost is not None and p.resting is not None
        }
        assert {at for at in points_of(drawn) if at[1] > 1.2 * low} == {at for at in expected if at[1] > 1.2 * low}
        assert len(points_of(drawn)) == len(expected)


def test_points_of_an_integrator_are_joined_along_the_time_step(figures: dict[str, Figure]) -> None:
    of = study()
    along = sorted((p for p in of.points if p.setting.integrator == "rk4" and not p.failure), key=lambda p: p.dt)
    assert points_of(line(figures["pareto"], "rk4")) == [place(p) for p in along]


def test_front_recommended_own_and_tolerance_are_drawn(figures: dict[str, Figure]) -> None:
    of = study()
    figure = figures["pareto"]
    corners = [(p.cost.median, 100.0 * p.worst) for p in front(of.points) if p.cost is not None]
    assert points_of(line(figure, "front")) == corners
    by_setting = {p.setting: p for p in of.points}
    assert points_of(line(figure, "recommended")) == [place(by_setting[CHOSEN])]
    assert points_of(line(figure, "own")) == [place(by_setting[OWN])]
    assert set(line(figure, "tolerance").get_ydata()) == {1.0}
    texts = [text.get_text() for text in figure.axes[0].texts]
    assert any(text.startswith("recommended\nvelocity Verlet, 100 µs\n") for text in texts)
    assert any(text.startswith("the scene's own\nsemi-implicit Euler, 40 µs\n") for text in texts)


def test_real_time_is_drawn_where_it_is_in_range(figures: dict[str, Figure]) -> None:
    of = study()
    assert set(line(figures["pareto"], "real time").get_xdata()) == {1.0}
    cheap = tuple(p for p in of.points if p.cost is None or p.cost.median < 0.1)
    assert lines(pareto_figure(replace(of, points=cheap)), "real time") == []


def test_the_axis_above_is_the_inverse_of_the_cost(figures: dict[str, Figure]) -> None:
    figure = figures["pareto"]
    figure.draw_without_rendering()
    (below,) = [ax for ax in figure.axes if ax.get_xlabel().startswith("cost")]
    (above,) = below.child_axes
    for cost in (0.01, 0.1, 1.0):
        assert above.transData.transform((1.0 / cost, 0.0))[0] == pytest.approx(
            below.transData.transform((cost, 1.0))[0]
        )


def test_the_references_doubt_is_a_floor(figures: dict[str, Figure]) -> None:
    of = study()
    texts = [text.get_text() for text in figures["pareto"].axes[0].texts]
    (below,) = (text for text in texts if text.startswith("below"))
    assert missing(below, ["reference", "0.0034 %"]) == []
    sure = replace(of, reference=replace(of.reference, doubt=errors(0.0)))
    assert not any(text.get_text().startswith("below") for text in pareto_figure(sure).axes[0].texts)


def test_an_error_too_small_to_show_stands_at_the_lower_edge() -> None:
    of = study()
    exact = replace(point("rk4", 2000), errors=errors(0.0))
    figure = pareto_figure(replace(of, points=(*of.points, exact)))
    assert exact.cost is not None
    (y,) = [y for x, y in points_of(line(figure, "rk4")) if x == exact.cost.median]
    low, high = figure.axes[0].get_ylim()
    assert low < y < low * (high / low) ** 0.05


def test_failures_are_listed_beside_the_diagram(figures: dict[str, Figure]) -> None:
    (listed,) = [text for text in figures["pareto"].findobj(Text) if text.get_gid() == "failed"]
    assert listed.get_text().splitlines() == [
        "semi-implicit Euler, 500 µs: unstable",
        "velocity Verlet, 500 µs: unstable",
        "RK4, 500 µs: chattering",
    ]


def test_more_failures_than_there_is_room_for_are_counted() -> None:
    many = tuple(failed("rk4", count, BLOWN) for count in range(1, 31))
    (listed,) = [t for t in pareto_figure(replace(study(), points=many)).findobj(Text) if t.get_gid() == "failed"]
    assert listed.get_text().endswith("and 16 more, see the table")


def test_slopes_drawn_are_the_expected_orders(figures: dict[str, Figure]) -> None:
    of = study()
    figure = figures["orders"]
    ax = panel(figure, "set down on a moving belt: time until it is carried")
    for order in (1.0, 2.0, 4.0, 5.0):
        (guide,) = [drawn for drawn in ax.lines if drawn.get_gid() == f"order {order:g}"]
        (x0, y0), (x1, y1) = points_of(guide)
        assert math.log(y1 / y0) / math.log(x1 / x0) == pytest.approx(-order)
    (row,) = [o for o in of.orders if o.case.startswith("set down") and o.integrator == "rk4"]
    (drawn,) = [drawn for drawn in ax.lines if drawn.get_gid() == "rk4"]
    assert points_of(drawn) == [(n, 100.0 * error) for n, error in zip(row.steps, row.errors, strict=True)]


def test_legends_tell_the_order_found_and_expected(figures: dict[str, Figure]) -> None:
    figure = figures["orders"]
    legend = panel(figure, "head on, Hertz").get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()][2].startswith("RK4\n2.5")
    assert all("(expected 2.5)" in text.get_text() for text in legend.get_texts())
    legend = panel(figure, "turn-table").get_legend()
    assert legend is not None
    assert not any("expected" in text.get_text() for text in legend.get_texts())


def test_intervals_and_verdicts_are_those_of_the_rows(figures: dict[str, Figure]) -> None:
    of = study()
    figure = figures["ensembles"]
    for name in dict.fromkeys(row.observable for row in of.comparisons):
        rows = [row for row in of.comparisons if row.observable == name]
        ax = panel(figure, name)
        intervals = [drawn for drawn in ax.lines if drawn.get_gid() == "interval"]
        assert [list(drawn.get_xdata()) for drawn in intervals] == [[100.0 * r.low, 100.0 * r.high] for r in rows]
        verdicts = [drawn.get_gid() for drawn in ax.lines if drawn.get_gid() in VERDICTS]
        assert verdicts == [row.verdict for row in rows]
        (band,) = [patch for patch in ax.patches if patch.get_gid() == "tolerance"]
        assert (band.get_x(), band.get_width()) == (-1.0, 2.0)


def test_verdicts_differ_in_marker_too(figures: dict[str, Figure]) -> None:
    figure = figures["ensembles"]
    markers = {
        drawn.get_gid(): drawn.get_marker() for ax in figure.axes for drawn in ax.lines if drawn.get_gid() in VERDICTS
    }
    assert len(set(markers.values())) == len(markers) == 3


def test_integrators_differ_in_marker_and_line_too(figures: dict[str, Figure]) -> None:
    figure = figures["pareto"]
    drawn = [line(figure, name) for name in (*RULES, "dormand_prince")]
    assert len({found.get_marker() for found in drawn}) == len(drawn)
    assert len({found.get_color() for found in drawn}) == len(drawn)


def test_a_difference_far_outside_stands_at_the_end_with_its_number(figures: dict[str, Figure]) -> None:
    ax = panel(figures["ensembles"], "peak force")
    (text,) = [text.get_text() for text in ax.texts]
    assert text == "-47.4 %"
    (drawn,) = [drawn for drawn in ax.lines if drawn.get_gid() == "different"]
    assert ax.get_xlim()[0] < points_of(drawn)[0][0] < -6.0


def test_an_interval_without_ends_is_said_in_words() -> None:
    of = study()
    row = replace(of.comparisons[0], low=-math.inf, high=math.inf, verdict="undecided")
    (ax,) = accuracy_figures(replace(of, comparisons=(row,)))["ensembles"].axes
    (text,) = ax.texts
    assert missing(text.get_text(), ["too few runs"]) == []


def test_peak_force_stands_beside_the_square_root_of_the_stiffness(figures: dict[str, Figure]) -> None:
    of = study()
    figure = figures["stiffness"]
    full = of.stiffness[0].observables["peak force, 99th percentile"][0]
    (low, start), (high, end) = points_of(line(figure, "root"))
    assert (high, end) == (1.0, full)
    assert start == pytest.approx(full * math.sqrt(low))


def test_deep_overlaps_are_hollow_in_every_panel(figures: dict[str, Figure]) -> None:
    of = study()
    figure = figures["stiffness"]
    for name in ("cost", "overlap", *of.stiffness[0].observables):
        for row in of.stiffness:
            hollow = line(figure, f"{name} {row.factor:g}").get_markerfacecolor() == "white"
            assert hollow == row.deep == (row.factor < 1.0)


def test_a_single_run_is_a_point_without_a_bar(figures: dict[str, Figure]) -> None:
    alone = tuple(
        replace(row, observables={name: (mean, math.inf) for name, (mean, _) in row.observables.items()})
        for row in study().stiffness
    )
    figure = accuracy_figures(replace(study(), stiffness=alone))["stiffness"]
    for name in alone[0].observables:
        assert points_of(line(figure, f"{name} 1")) == points_of(line(figures["stiffness"], f"{name} 1"))
        assert np.isfinite(panel(figure, name).get_ylim()).all()


def test_a_quantity_that_was_not_measured_is_said_to_be_so() -> None:
    of = study()
    rows = (replace(of.stiffness[0], overlap=None, cost_ratio=None, observables={}),)
    figure = accuracy_figures(replace(of, stiffness=rows))["stiffness"]
    assert [text.get_text() for ax in figure.axes for text in ax.texts] == ["not measured", "not measured"]


def test_logarithmic_axes_have_plain_numbers(ax: Axes) -> None:
    for low, high, texts in (
        (0.04, 3.0, ["0.05", "0.1", "0.2", "0.5", "1", "2"]),
        (1e-6, 1.0, ["1e-6", "1e-5", "0.0001", "0.001", "0.01", "0.1", "1"]),
    ):
        logarithmic_x(ax, low, high)
        ax.figure.draw_without_rendering()
        assert [text.get_text() for text in ax.get_xticklabels()] == texts


def test_a_note_that_would_cover_something_is_left_out_unless_it_is_needed(ax: Axes) -> None:
    ax.set_xlim(0.0, 1.0)
    ax.set_ylim(0.0, 1.0)
    crowd = np.stack(np.meshgrid(np.linspace(0.0, 1.0, 60), np.linspace(0.0, 1.0, 60)), axis=-1).reshape(-1, 2)
    place_notes(ax, [Note("kept", (0.5, 0.5), needed=True), Note("left out", (0.2, 0.2))], crowd, [])
    assert [text.get_text() for text in ax.texts] == ["kept"]


def test_notes_keep_off_points_lines_and_each_other(ax: Axes) -> None:
    ax.set_xlim(0.0, 1.0)
    ax.set_ylim(0.0, 1.0)
    at = np.array([(0.3, 0.5), (0.33, 0.5), (0.6, 0.5)])
    level = np.array([(0.0, 0.5), (1.0, 0.5)])
    place_notes(ax, [Note(f"note {i}", (float(x), float(y))) for i, (x, y) in enumerate(at)], at, [level])
    boxes = [text.get_window_extent() for text in ax.texts]
    assert len(boxes) == 3
    height = ax.transData.transform((0.0, 0.5))[1]
    assert all(box.y0 > height or box.y1 < height for box in boxes)
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))
