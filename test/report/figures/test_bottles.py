# SPDX-License-Identifier: Apache-2.0
"""Bottles are drawn where they are and as large as they are, contact forces as wide as they are strong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import Normalize

from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.bottles import ForceScale, draw_bottles, draw_forces, draw_orientation, speed_scale
from conveyor_sim.report.figures.data import Contacts, PlantFrame, StaticGeometry

NORM = Normalize(0.0, 1.0)


def test_one_circle_a_bottle_of_its_size_and_place(ax: Axes, frame: PlantFrame) -> None:
    drawn = {
        (float(x), float(y), float(circles.get_widths()[0]) / 2.0)
        for circles in draw_bottles(ax, frame, NORM, 0.5)
        for x, y in circles.get_offsets()
    }
    assert drawn == set(zip(frame.x.tolist(), frame.y.tolist(), frame.radius.tolist(), strict=True))


def test_circles_are_to_scale_on_the_page(ax: Axes, frame: PlantFrame) -> None:
    ax.set_xlim(-2.0, 2.0)
    ax.set_ylim(-2.0, 2.0)
    ax.set_aspect("equal")
    (circles, _) = draw_bottles(ax, frame, NORM, 0.5)
    ax.figure.draw_without_rendering()
    unit = circles.get_transform().transform((1.0, 0.0))[0]
    metre = ax.transData.transform((1.0, 0.0))[0] - ax.transData.transform((0.0, 0.0))[0]
    assert circles.get_transforms()[0][0, 0] * unit == pytest.approx(0.05 * metre)


def test_colour_is_the_speed(ax: Axes, frame: PlantFrame) -> None:
    small, large = draw_bottles(ax, frame, NORM, 0.5)
    np.testing.assert_allclose(small.get_facecolor(), style.SPEED(frame.speed[:2]))
    np.testing.assert_allclose(large.get_facecolor(), style.SPEED(frame.speed[2:]))


def test_no_bottles_draw_nothing(ax: Axes, frame: PlantFrame) -> None:
    empty = frame.within((10.0, 10.0, 11.0, 11.0))
    assert draw_bottles(ax, empty, NORM, 0.5) == []
    assert len(draw_orientation(ax, empty, NORM, 0.5).get_segments()) == 0


def test_tick_shows_the_angle(ax: Axes, frame: PlantFrame) -> None:
    ticks = np.array(draw_orientation(ax, frame, NORM, 0.5).get_segments())
    np.testing.assert_allclose(ticks[:, 1], [[0.65, 0.951], [0.7, 1.002], [-1.08, 0.5]])


def test_width_of_a_line_of_force_is_proportional_to_the_force(ax: Axes, frame: PlantFrame) -> None:
    scale = ForceScale.covering([frame], widest=6.0)
    assert scale is not None
    lines = draw_forces(ax, frame, scale)
    assert frame.contacts is not None
    np.testing.assert_allclose(lines.get_segments(), frame.contacts.lines)
    np.testing.assert_allclose(lines.get_linewidths(), [1.5, 6.0])


def test_all_frames_share_one_scale(frame: PlantFrame) -> None:
    harder = replace(frame, contacts=Contacts(np.zeros((1, 2, 2)), np.array([80.0])))
    scale = ForceScale.covering([frame, harder], widest=6.0)
    assert scale is not None
    assert scale.points_per_newton == pytest.approx(6.0 / 80.0)


def test_forces_far_below_the_peak_of_the_run_look_weak(frame: PlantFrame) -> None:
    scale = ForceScale.covering([frame], widest=6.0, peak=4000.0)
    assert scale is not None
    assert 40.0 * scale.points_per_newton == pytest.approx(0.6)


def test_forces_too_weak_to_see_are_left_out(ax: Axes, frame: PlantFrame) -> None:
    weak = replace(frame, contacts=Contacts(np.zeros((2, 2, 2)), np.array([1000.0, 1e-3])))
    scale = ForceScale.covering([weak], widest=6.0)
    assert scale is not None
    assert len(draw_forces(ax, weak, scale).get_segments()) == 1


def test_without_contacts_there_is_no_scale(frame: PlantFrame) -> None:
    assert ForceScale.covering([replace(frame, contacts=None)], widest=6.0) is None
    assert ForceScale.covering([replace(frame, contacts=Contacts())], widest=6.0) is None


def test_legend_shows_forces_in_newtons_at_their_width(ax: Axes, frame: PlantFrame) -> None:
    scale = ForceScale.covering([frame], widest=6.0)
    assert scale is not None
    legend = scale.legend(ax.figure)
    shown = dict(zip([text.get_text() for text in legend.get_texts()], legend.get_lines(), strict=True))
    assert list(shown) == ["contact force", "2 N", "10 N", "20 N"]
    assert shown["20 N"].get_linewidth() == pytest.approx(3.0)


def test_speed_scale_spans_the_belts(plant: StaticGeometry, frame: PlantFrame) -> None:
    assert speed_scale(plant, [frame]).vmax == pytest.approx(1.05 * 0.8)


def test_speed_scale_spans_surfaces_faster_than_their_belt(plant: StaticGeometry, frame: PlantFrame) -> None:
    twice = replace(plant, surfaces=tuple(replace(surface, ratio=2.0) for surface in plant.surfaces))
    assert speed_scale(twice, [frame]).vmax == pytest.approx(2.0 * 1.05 * 0.8)


def test_one_bottle_shot_off_does_not_stretch_the_speed_scale(plant: StaticGeometry, frame: PlantFrame) -> None:
    speed = np.concatenate([np.full(99, 0.5), [30.0]])
    many = PlantFrame(0.0, *np.zeros((3, 100)), np.full(100, 0.05), speed, frame.belt_speeds)
    assert speed_scale(plant, [many]).vmax == pytest.approx(1.05 * 0.8)


def test_speed_scale_spans_the_bottles_where_all_belts_rest(plant: StaticGeometry, frame: PlantFrame) -> None:
    resting = replace(frame, belt_speeds=np.zeros(6), speed=np.array([0.3, 0.3, 0.3]))
    assert speed_scale(plant, [resting]).vmax == pytest.approx(1.05 * 0.3)
    assert speed_scale(plant, [replace(resting, speed=np.zeros(3))]).vmax == 1.0
