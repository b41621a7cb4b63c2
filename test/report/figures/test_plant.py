# SPDX-License-Identifier: Apache-2.0
"""What stands still is drawn where it is, and its travel as it runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import Collection
from matplotlib.colors import Normalize

from conveyor_sim.report.figures.data import StaticGeometry
from conveyor_sim.report.figures.plant import draw_belts, draw_plant, draw_rails, draw_travel

NORM = Normalize(0.0, 1.0)


def chevrons(ax: Axes, plant: StaticGeometry, speeds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tips (n, 2) of the chevrons, and the directions (n, 2) in which they point."""
    shapes = np.array(draw_travel(ax, plant, speeds, 0.1).get_segments())
    pointing = shapes[:, 1] - 0.5 * (shapes[:, 0] + shapes[:, 2])
    return shapes[:, 1], pointing / np.hypot(*pointing.T)[:, None]


def only(plant: StaticGeometry, name: str) -> StaticGeometry:
    index = [surface.name for surface in plant.surfaces].index(name)
    return StaticGeometry((replace(plant.surfaces[index], belt=0),), plant.speeds[index : index + 1], ())


def artist(ax: Axes, gid: str) -> Collection:
    (found,) = [collection for collection in ax.collections if collection.get_gid() == gid]
    return found


def test_each_belt_is_the_area_of_its_outline(ax: Axes, plant: StaticGeometry) -> None:
    paths = draw_belts(ax, plant, plant.speeds, NORM).get_paths()
    assert len(paths) == len(plant.surfaces)
    for path, shape in zip(paths, plant.surfaces, strict=True):
        np.testing.assert_allclose(path.vertices[:-1], shape.outline(96))


def test_faster_belts_are_darker(ax: Axes, plant: StaticGeometry) -> None:
    tint = draw_belts(ax, plant, plant.speeds, NORM).get_facecolor()[:, :3].sum(axis=1)
    assert np.all(np.diff(tint[np.argsort(np.abs(plant.speeds))]) < 0.0)


def test_chevrons_point_along_a_straight_belt(ax: Axes, plant: StaticGeometry) -> None:
    _, pointing = chevrons(ax, only(plant, "feeder"), np.array([0.8]))
    np.testing.assert_allclose(pointing, np.broadcast_to([1.0, 0.0], pointing.shape), atol=1e-12)


def test_chevrons_point_back_on_a_belt_that_runs_backwards(ax: Axes, plant: StaticGeometry) -> None:
    _, pointing = chevrons(ax, only(plant, "slope"), np.array([-0.5]))
    np.testing.assert_allclose(pointing, np.broadcast_to(-np.array([np.sqrt(0.75), 0.5]), pointing.shape), atol=1e-12)


def test_chevrons_turn_counter_clockwise_on_a_curve_and_clockwise_at_negative_speed(
    ax: Axes, plant: StaticGeometry
) -> None:
    for name, speed, sense in (("bend", 0.4, 1.0), ("ring", -0.3, -1.0)):
        belt = only(plant, name)
        tips, pointing = chevrons(ax, belt, np.array([speed]))
        arm = tips - np.array(belt.surfaces[0].centre)
        turning = arm[:, 0] * pointing[:, 1] - arm[:, 1] * pointing[:, 0]
        assert np.all(sense * turning > 0.9 * np.hypot(*arm.T))


def test_a_turning_ring_shows_its_travel_all_around(ax: Axes, plant: StaticGeometry) -> None:
    tips, _ = chevrons(ax, only(plant, "ring"), np.array([0.3]))
    quadrants = {(x > 1.0, y > 2.5) for x, y in tips}
    assert len(quadrants) == 4


def test_chevrons_lie_on_their_belts(ax: Axes, plant: StaticGeometry) -> None:
    for shape, speed in zip(plant.surfaces, plant.speeds, strict=True):
        if speed != 0.0:
            tips, _ = chevrons(ax, only(plant, shape.name), np.array([speed]))
            belt = draw_belts(ax, only(plant, shape.name), np.array([speed]), NORM).get_paths()[0]
            assert len(tips) > 0
            assert belt.contains_points(tips).all()


def test_a_belt_at_rest_has_no_chevrons(ax: Axes, plant: StaticGeometry) -> None:
    assert len(draw_travel(ax, only(plant, "still"), np.array([0.0]), 0.1).get_segments()) == 0


def test_rails_come_in_the_order_of_their_indices(ax: Axes, plant: StaticGeometry) -> None:
    drawn = draw_rails(ax, plant).get_segments()
    assert [rail.name for rail in plant.rails] == ["top", "bottom", "bend_inner", "bend_outer"]
    for line, rail in zip(drawn, plant.rails, strict=True):
        np.testing.assert_allclose(line, rail.outline(96))


def test_infeed_points_where_its_bottles_go_from_where_they_appear(ax: Axes, plant: StaticGeometry) -> None:
    draw_plant(ax, plant, plant.speeds, NORM, 0.1)
    (triangle,) = artist(ax, "infeeds").get_paths()
    tip, left, right = triangle.vertices[:3]
    np.testing.assert_allclose(tip, [-1.8, 0.5])
    ahead = tip - 0.5 * (left + right)
    np.testing.assert_allclose(ahead / np.hypot(*ahead), [1.0, 0.0], atol=1e-12)


def test_outfeed_is_its_region(ax: Axes, plant: StaticGeometry) -> None:
    draw_plant(ax, plant, plant.speeds, NORM, 0.1)
    (region,) = artist(ax, "outfeeds").get_paths()
    np.testing.assert_allclose(region.vertices[:3], [[4.5, 1.0], [5.0, 1.0], [5.0, 1.5]])


def test_sensors_are_where_the_scene_has_them_and_a_counters_arrow_points_forward(
    ax: Axes, plant: StaticGeometry
) -> None:
    draw_plant(ax, plant, plant.speeds, NORM, 0.1)
    (beam,) = artist(ax, "photo_eyes").get_segments()
    np.testing.assert_allclose(beam, [[-0.2, 0.35], [-0.2, 0.65]])
    (zone,) = artist(ax, "zones").get_paths()
    np.testing.assert_allclose(zone.vertices[:4], [[1.2, 0.1], [1.9, 0.25], [1.9, 0.9], [1.2, 0.9]])
    line, arrow = artist(ax, "counters").get_segments()
    np.testing.assert_allclose(line, [[3.2, 0.5], [3.5, 0.1]])
    np.testing.assert_allclose(arrow[1] - arrow[0], 0.1 * np.array([-0.8, -0.6]))


def test_a_metre_is_as_long_in_x_as_in_y(ax: Axes, plant: StaticGeometry) -> None:
    draw_plant(ax, plant, plant.speeds, NORM, 0.1)
    assert ax.get_aspect() == 1.0
