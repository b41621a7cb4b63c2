# SPDX-License-Identifier: Apache-2.0
"""Names stand beside what they name and never on each other."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import Normalize

from conveyor_sim.report.figures.data import StaticGeometry
from conveyor_sim.report.figures.labels import belt_labels, mark_labels, place, rail_labels
from conveyor_sim.report.figures.plant import draw_plant
from conveyor_sim.scene import load_scene

SCENE = Path(__file__).with_name("small_plant.yaml")


def test_belts_carry_name_and_speed(plant: StaticGeometry) -> None:
    texts = [label.text for label in belt_labels(plant, plant.speeds)]
    assert texts[:3] == ["feeder\n0.8 m/s", "table\n0.2 m/s", "slope\n-0.5 m/s"]


def test_rails_of_curved_belts_are_not_named_again(plant: StaticGeometry) -> None:
    assert [label.text for label in rail_labels(plant)] == ["top", "bottom"]


def test_infeeds_and_outfeeds_are_named(plant: StaticGeometry) -> None:
    assert [label.text for label in mark_labels(plant)] == ["infeed inlet", "outfeed reject"]


def test_labels_are_inside_the_axes_apart_and_near_their_anchors(ax: Axes, plant: StaticGeometry) -> None:
    draw_plant(ax, plant, plant.speeds, Normalize(0.0, 1.0), 0.1)
    ax.set_xlim(-3.5, 6.0)
    ax.set_ylim(-2.0, 4.0)
    labels = mark_labels(plant) + belt_labels(plant, plant.speeds) + rail_labels(plant)
    place(ax, labels, plant)
    frame = ax.get_window_extent()
    boxes = [text.get_window_extent() for text in ax.texts]
    assert [text.get_text() for text in ax.texts] == [label.text for label in labels]
    for box, label in zip(boxes, labels, strict=True):
        assert frame.x0 <= box.x0 and box.x1 <= frame.x1 and frame.y0 <= box.y0 and box.y1 <= frame.y1
        anchors = ax.transData.transform(label.anchors)
        nearest = np.hypot(*(anchors - (0.5 * (box.x0 + box.x1), 0.5 * (box.y0 + box.y1))).T).min()
        assert nearest < 0.5 * np.hypot(box.width, box.height) + 10.0
    for one, other in combinations(boxes, 2):
        assert not one.overlaps(other)


def test_the_name_of_a_belt_is_not_written_on_another_belt(ax: Axes, plant: StaticGeometry) -> None:
    draw_plant(ax, plant, plant.speeds, Normalize(0.0, 1.0), 0.1)
    ax.set_xlim(-3.5, 6.0)
    ax.set_ylim(-2.0, 4.0)
    place(ax, belt_labels(plant, plant.speeds), plant)
    areas = next(c for c in ax.collections if c.get_gid() == "belts").get_paths()
    for text in ax.texts:
        centre = text.get_position()
        assert not any(area.contains_point(centre) for area in areas)


def test_the_name_of_a_guide_across_a_belt_is_beside_the_belt(ax: Axes, tmp_path: Path) -> None:
    rails = "  across: {kind: segment, from: [-1.0, 0.42], to: [-1.0, 0.58], material: steel}\n"
    scene = tmp_path / "scene.yaml"
    scene.write_text(SCENE.read_text().replace("rails:\n", "rails:\n" + rails))
    plant = StaticGeometry.of(load_scene(scene))
    draw_plant(ax, plant, plant.speeds, Normalize(0.0, 1.0), 0.1)
    ax.set_xlim(-3.5, 6.0)
    ax.set_ylim(-2.0, 4.0)
    place(ax, [label for label in rail_labels(plant) if label.text == "across"], plant)
    (text,) = ax.texts
    x, y = text.get_position()
    assert x == pytest.approx(-1.0, abs=0.01)
    assert not 0.4 < y < 0.6


def test_in_a_crowd_names_are_joined_by_lines_or_left_out(ax: Axes, plant: StaticGeometry) -> None:
    draw_plant(ax, plant, plant.speeds, Normalize(0.0, 1.0), 0.1)
    ax.set_xlim(-3.5, 6.0)
    ax.set_ylim(-2.0, 4.0)
    labels = 12 * (belt_labels(plant, plant.speeds) + rail_labels(plant))
    drawn = len(ax.lines)
    place(ax, labels, plant)
    assert len(plant.surfaces) + 2 < len(ax.texts) < len(labels)
    boxes = [text.get_window_extent() for text in ax.texts]
    far = 0
    for box, text in zip(boxes, ax.texts, strict=True):
        label = next(label for label in labels if label.text == text.get_text())
        anchors = ax.transData.transform(label.anchors)
        away = np.hypot(*(anchors - (0.5 * (box.x0 + box.x1), 0.5 * (box.y0 + box.y1))).T).min()
        far += away > 0.5 * np.hypot(box.width, box.height) + 30.0
    assert len(ax.lines) - drawn >= far > 0
    for one, other in combinations(boxes, 2):
        shared = max(0.0, min(one.x1, other.x1) - max(one.x0, other.x0)) * max(
            0.0, min(one.y1, other.y1) - max(one.y0, other.y0)
        )
        assert shared < 0.1 * min(one.width * one.height, other.width * other.height)
