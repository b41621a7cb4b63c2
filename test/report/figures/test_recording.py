# SPDX-License-Identifier: Apache-2.0
"""From a real, small bag: what is drawn is what was recorded, and what it does not hold is a clear error."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from facts import stating
from matplotlib.colors import Normalize
from report.figures.small_bag import SLOW_SPEED, record

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.errors import BagError, ConveyorError
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.bottles import draw_bottles
from conveyor_sim.report.figures.draw import plot_bag
from conveyor_sim.report.figures.recording import Recording
from conveyor_sim.report.figures.views import table_figure


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("bags") / "small")


@pytest.fixture
def recording(bag: Path) -> Iterator[Recording]:
    with open_bag(bag) as opened, style.look():
        yield Recording(opened)


def test_circles_are_the_bottles_recorded_at_that_time(bag: Path, recording: Recording) -> None:
    (frame,) = recording.frames([0.32])
    with open_bag(bag) as opened:
        (recorded,) = [f.data for f in opened.bottles() if f.tick == 32]
    ax = style.new_figure(4.0, 4.0).subplots()
    drawn = {
        (float(x), float(y), float(circles.get_widths()[0]) / 2.0)
        for circles in draw_bottles(ax, frame, Normalize(0.0, 1.0), 0.5)
        for x, y in circles.get_offsets()
    }
    radius = np.array([0.05, 0.08])[recorded.type]
    assert drawn == set(zip(recorded.x.tolist(), recorded.y.tolist(), radius.tolist(), strict=True))
    np.testing.assert_array_equal(frame.speed, np.hypot(recorded.vx, recorded.vy))


def test_times_snap_to_the_nearest_record_with_contacts_and_the_title_says_so(recording: Recording) -> None:
    frames = recording.frames([0.13, 0.0])
    assert [frame.time for frame in frames] == [0.0, pytest.approx(0.12)]
    figure = table_figure(recording.plant, frames, "small_plant")
    titles = [ax.get_title(loc="left") for ax in figure.axes]
    assert titles[0].startswith("t = 0.00 s, ") and titles[1].startswith("t = 0.12 s, ")


def test_default_times_are_the_quarters_and_the_end(recording: Recording) -> None:
    assert [frame.time for frame in recording.frames(None)] == pytest.approx([0.12, 0.24, 0.36, 0.48])


def test_each_instant_comes_once(recording: Recording) -> None:
    assert len(recording.frames([0.08, 0.081, 0.079])) == 1


@pytest.mark.parametrize("time", [-1.0, 0.6, 20.0])
def test_a_time_outside_the_recording_is_a_clear_error(recording: Recording, time: float) -> None:
    with pytest.raises(ConveyorError, match=stating(f"time {time:g} s", "0 to 0.48 s")):
        recording.frames([time])


def test_forces_join_the_axes_of_bottles_that_touch(bag: Path, recording: Recording) -> None:
    with open_bag(bag) as opened:
        pairs = [(f.time, f.data) for f in opened.contacts() if (f.data.kind == 0).any()]
    time, recorded = pairs[0]
    (frame,) = recording.frames([time])
    assert frame.contacts is not None
    (line,) = frame.contacts.lines[recorded.kind == 0]
    axes = {(x, y) for x, y in zip(frame.x, frame.y, strict=True)}
    assert {tuple(line[0]), tuple(line[1])} <= axes
    assert tuple(line[0]) != tuple(line[1])
    np.testing.assert_array_equal(frame.contacts.force, recorded.normal_force)


def test_forces_at_a_rail_join_the_axis_to_the_point_on_the_rail(bag: Path, recording: Recording) -> None:
    with open_bag(bag) as opened:
        touching = [(f.time, f.data) for f in opened.contacts() if (f.data.kind == 1).any()]
    time, recorded = touching[0]
    (frame,) = recording.frames([time])
    assert frame.contacts is not None
    (line,) = frame.contacts.lines[recorded.kind == 1]
    (large,) = np.flatnonzero(frame.radius == 0.08)
    np.testing.assert_array_equal(line[0], [frame.x[large], frame.y[large]])
    np.testing.assert_array_equal(line[1], [recorded.x[recorded.kind == 1][0], recorded.y[recorded.kind == 1][0]])
    assert line[1, 1] == pytest.approx(1.0, abs=0.08)


def test_belts_have_the_speeds_they_had_then(recording: Recording) -> None:
    before, after = recording.frames([0.08, 0.48])
    feeder = recording.belts.index("feeder")
    assert before.belt_speeds[feeder] == 0.8
    assert after.belt_speeds[feeder] == SLOW_SPEED


def test_velocities_are_the_recorded_ones(bag: Path, recording: Recording) -> None:
    (velocity,) = recording.velocities([0])
    with open_bag(bag) as opened:
        recorded = [(f.time, f.data.vx[0], f.data.vy[0], f.data.belt[0]) for f in opened.bottles()]
    np.testing.assert_array_equal(
        np.stack([velocity.time, velocity.vx, velocity.vy, velocity.belt], axis=1), np.array(recorded)
    )


def test_default_bottles_are_the_first_and_the_last_fed_where_there_are_fewer_than_fifty(recording: Recording) -> None:
    assert [(v.bottle, v.born) for v in recording.velocities(None)] == [(3, 1), (5, 3)]


def test_bottles_that_were_there_from_the_start_are_told_apart(recording: Recording) -> None:
    assert [v.born for v in recording.velocities([2, 3])] == [0, 1]


def test_a_bottle_that_never_was_is_a_clear_error(recording: Recording) -> None:
    with pytest.raises(ConveyorError, match=stating("bottle 77", "id", "0 to 5")):
        recording.velocities([0, 77])


def test_flow_counts_what_came_and_went(bag: Path, recording: Recording) -> None:
    flow = recording.flow
    with open_bag(bag) as opened:
        present = [set(f.data.id.tolist()) for f in opened.bottles()]
    ever = [set().union(*present[: n + 1]) for n in range(len(present))]
    np.testing.assert_array_equal(flow.present, [len(now) for now in present])
    np.testing.assert_array_equal(flow.fed, [len(seen - {0, 1, 2}) for seen in ever])
    np.testing.assert_array_equal(flow.removed, [len(seen - now) for seen, now in zip(ever, present, strict=True)])
    assert flow.fed[-1] == 3 and flow.removed[-1] >= 1


def test_flow_on_belts_is_where_the_bottles_stood(bag: Path, recording: Recording) -> None:
    with open_bag(bag) as opened:
        expected = [[int((f.data.belt == belt).sum()) for belt in range(6)] for f in opened.bottles()]
    np.testing.assert_array_equal(recording.flow.on_belt, expected)
    feeder, table = recording.belts.index("feeder"), recording.belts.index("table")
    assert recording.flow.entered[-1, feeder] == 3
    assert recording.flow.entered[-1, table] == 0


def test_peak_forces_are_taken_over_the_bottles(bag: Path, recording: Recording) -> None:
    with open_bag(bag) as opened:
        forces = [f.data.peak_force for f in opened.bottles()]
    np.testing.assert_array_equal(recording.peak_force.largest, [force.max() for force in forces])
    np.testing.assert_array_equal(recording.peak_force.percentile_99, [np.percentile(force, 99) for force in forces])
    assert recording.peak_force.largest.max() > 0.0


def test_the_plant_is_the_one_that_ran(recording: Recording) -> None:
    np.testing.assert_allclose(recording.plant.drawn_as("exit")[0].points[0], [-1.6, 0.3])


def test_plot_bag_writes_every_picture_as_png_and_svg(bag: Path, tmp_path: Path) -> None:
    written = plot_bag(bag, tmp_path / "pictures", times=[0.2, 0.4], bottles=[3])
    names = ["table", "plant", "velocity_bottle_3", "flow", "force"]
    assert written == [tmp_path / "pictures" / f"{name}{suffix}" for name in names for suffix in (".png", ".svg")]
    assert all(path.stat().st_size > 1000 for path in written)


def test_a_bag_without_contacts_and_belts_is_drawn_without_forces(tmp_path: Path) -> None:
    bag = record(tmp_path / "bare", topics=["line", "bottles"])
    with open_bag(bag) as opened:
        recording = Recording(opened)
        (frame,) = recording.frames([0.3])
        assert frame.contacts is None
        np.testing.assert_array_equal(frame.belt_speeds, recording.plant.speeds)
    assert len(plot_bag(bag, tmp_path / "pictures")) == 12


def test_a_bag_without_bottles_is_a_clear_error(tmp_path: Path) -> None:
    bag = record(tmp_path / "blind", topics=["line", "belts"])
    with pytest.raises(BagError, match=stating(str(bag), "no message", "topic bottles")):
        plot_bag(bag, tmp_path / "pictures")


def test_a_line_on_which_there_never_was_a_bottle_is_drawn(tmp_path: Path) -> None:
    bag = record(tmp_path / "empty", changes={"bottles": [], "infeeds": {"inlet": {"start": 9.0}}})
    names = {path.stem for path in plot_bag(bag, tmp_path / "pictures")}
    assert names == {"table", "plant", "flow", "force"}
