# SPDX-License-Identifier: Apache-2.0
"""The picture of a failed test: the line at that moment, and the traces that lead to it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Contacts, PlantFrame, StaticGeometry
from conveyor_sim.report.figures.moment import MarkedEvent, Trace, moment_figure

TIME = np.linspace(0.0, 2.5, 251)
STEP = np.where(TIME < 1.0, 0.0, 1.0)
TRACES = (
    Trace("photo_eyes/entry/blocked", "", "bool", STEP),
    Trace("belts/table/speed", "m/s", "number", 0.4 * STEP),
    Trace("belts/table/cmd_speed", "m/s", "number", np.where(TIME < 2.0, np.nan, 0.4)),
    Trace("alarms/jam", "", "bool", np.full(TIME.size, np.nan)),
)


@pytest.fixture(autouse=True)
def look() -> Iterator[None]:
    with style.look():
        yield


def axes(figure: Figure) -> list[Axes]:
    """The view, then the traces from above."""
    return sorted(
        (ax for ax in figure.axes if ax.get_label() != "<colorbar>"), key=lambda ax: -ax.get_window_extent().y1
    )


def drawn(plant: StaticGeometry, frame: PlantFrame, *events: MarkedEvent, blocked: tuple[str, ...] = ()) -> list[Axes]:
    return axes(moment_figure(plant, frame, "small_plant", "It did not hold", blocked, TIME, TRACES, events))


def test_it_says_what_where_and_when(plant: StaticGeometry, frame: PlantFrame) -> None:
    view, *rows = drawn(plant, frame)
    assert view.get_title(loc="left") == "t = 2.50 s, 3 bottles\nIt did not hold"
    assert view.figure.get_suptitle() == "small_plant"
    names = {text.get_text().split("\n")[0] for text in view.texts}
    assert {"infeed inlet", "eye entry", "feeder", "table"} <= names
    assert [row.get_title(loc="left") for row in rows] == [
        "photo_eyes/entry/blocked", "belts/table/speed (m/s)", "belts/table/cmd_speed (m/s)", "alarms/jam",
    ]  # fmt: skip


def test_traces_are_the_signals_and_tell_their_last_values(plant: StaticGeometry, frame: PlantFrame) -> None:
    _, *rows = drawn(plant, frame)
    for row, trace in zip(rows, TRACES, strict=True):
        (line,) = (line for line in row.lines if line.get_gid() == trace.name)
        np.testing.assert_array_equal(line.get_ydata(), trace.values)
    assert [row.texts[-1].get_text() for row in (rows[1], rows[2], rows[3])] == ["0.4", "0.4", ""]
    assert "on" in {text.get_text() for text in rows[0].texts}


def test_only_blocked_eyes_are_broad(plant: StaticGeometry, frame: PlantFrame) -> None:
    def beams(*blocked: str) -> int:
        view = drawn(plant, frame, blocked=blocked)[0]
        return sum(len(c.get_segments()) for c in view.collections if c.get_gid() == "blocked")  # type: ignore[attr-defined]

    assert (beams(), beams("entry")) == (0, 1)


def test_events_are_marked_in_every_trace_and_named_once(plant: StaticGeometry, frame: PlantFrame) -> None:
    _, *rows = drawn(plant, frame, MarkedEvent(0.5, "stop = 1"), MarkedEvent(2.0, "stop = 0"))
    for row in rows:
        assert [line.get_xdata()[0] for line in row.lines if line.get_gid() is None] == [0.5, 2.0]
    texts = [[text.get_text() for text in row.texts if "stop" in text.get_text()] for row in rows]
    assert sorted(texts[0]) == ["stop = 0", "stop = 1"]
    assert texts[1:] == [[], [], []]


def test_what_has_come_to_rest_looks_it(plant: StaticGeometry, frame: PlantFrame) -> None:
    """Rounding leaves some speed and force; neither scale is made of that."""
    still = replace(
        frame,
        speed=np.full(3, 1e-12),
        belt_speeds=np.zeros(len(plant.speeds)),
        contacts=Contacts(frame.contacts.lines, np.full(2, 1e-10)) if frame.contacts else None,
    )
    view = drawn(plant, still)[0]
    assert not [c for c in view.collections if c.get_gid() == "forces"]
    (large, small) = (c for c in view.collections if c.get_gid() == "bottles")
    rest = style.SPEED(0.0)
    assert np.allclose(large.get_facecolor(), rest) and np.allclose(small.get_facecolor(), rest)


def test_forced_signals_are_named_and_their_traces_say_so(plant: StaticGeometry, frame: PlantFrame) -> None:
    traces = (replace(TRACES[0], forced=True), *TRACES[1:])
    forced = ("photo_eyes/entry/blocked", "zones/z/bottles")
    figure = moment_figure(plant, frame, "small_plant", "It did not hold", (), TIME, traces, forced=forced)
    assert figure.get_supxlabel() == "forced: photo_eyes/entry/blocked, zones/z/bottles"
    assert [row.get_title(loc="left") for row in axes(figure)[1:3]] == [
        "photo_eyes/entry/blocked, forced",
        "belts/table/speed (m/s)",
    ]
