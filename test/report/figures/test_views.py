# SPDX-License-Identifier: Apache-2.0
"""Figures from above: what they show, of when, and in which units."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Contacts, PlantFrame, StaticGeometry
from conveyor_sim.report.figures.views import plant_figure, scene_figure, table_figure, table_region
from conveyor_sim.scene import Scene


@pytest.fixture(autouse=True)
def look() -> Iterator[None]:
    with style.look():
        yield


def panels(figure: Figure) -> list[Axes]:
    return [ax for ax in figure.axes if ax.get_label() != "<colorbar>" and ax.get_visible()]


def count(ax: Axes, gid: str) -> int:
    return sum(len(c.get_offsets()) for c in ax.collections if c.get_gid() == gid)


def test_table_has_one_panel_a_frame_with_its_time(plant: StaticGeometry, frame: PlantFrame) -> None:
    frames = [frame, replace(frame, time=5.0), replace(frame, time=7.125)]
    titles = [ax.get_title(loc="left") for ax in panels(table_figure(plant, frames, "small_plant"))]
    assert titles == [
        "t = 2.50 s, 2 bottles in view",
        "t = 5.00 s, 2 bottles in view",
        "t = 7.125 s, 2 bottles in view",
    ]


def test_table_shows_the_widest_belt_and_the_bottles_there(plant: StaticGeometry, frame: PlantFrame) -> None:
    (ax,) = panels(table_figure(plant, [frame], "small_plant"))
    (x0, x1), (y0, y1) = ax.get_xlim(), ax.get_ylim()
    assert -0.5 < x0 < 0.0 and 2.0 < x1 < 2.5
    assert -0.5 < y0 < 0.0 and 1.0 < y1 < 1.5
    assert count(ax, "bottles") == 2


def test_a_plant_that_is_one_belt_is_shown_whole(plant: StaticGeometry, frame: PlantFrame) -> None:
    single = StaticGeometry((replace(plant.surfaces[1], belt=0),), plant.speeds[1:2], plant.rails[:2])
    x0, y0, x1, y1 = table_region(single, [frame.within((0.0, 0.0, 2.0, 1.0))])
    assert x0 < 0.0 and y0 < 0.0 and x1 > 2.0 and y1 > 1.0


def test_a_plant_without_belts_is_shown_whole(plant: StaticGeometry, frame: PlantFrame) -> None:
    bare = StaticGeometry((), np.empty(0), plant.rails[:2])
    (ax,) = panels(table_figure(bare, [replace(frame, belt_speeds=np.empty(0))], "bare"))
    assert count(ax, "bottles") == 3


def test_bottles_without_a_plant_are_all_in_view_at_every_time(frame: PlantFrame) -> None:
    free = replace(frame, belt_speeds=np.empty(0))
    apart = replace(free, x=5.0 * free.x)
    x0, _, x1, _ = table_region(StaticGeometry((), np.empty(0), ()), [free, apart])
    assert x0 < -5.0 - 0.08 and x1 > 3.5 + 0.05


def test_plant_shows_every_bottle_and_names_every_belt(plant: StaticGeometry, frame: PlantFrame) -> None:
    figure = plant_figure(plant, frame, "small_plant")
    (ax,) = panels(figure)
    assert figure.get_suptitle() == "small_plant"
    assert ax.get_title(loc="left") == "t = 2.50 s, 3 bottles"
    assert count(ax, "bottles") == 3
    names = {text.get_text().split("\n")[0] for text in ax.texts}
    marks = {"infeed inlet", "outfeed reject", "eye entry", "zone waiting", "counter exit"}
    assert names == {surface.name for surface in plant.surfaces} | marks


def test_plant_labels_belts_with_the_speeds_of_that_instant(plant: StaticGeometry, frame: PlantFrame) -> None:
    slowed = replace(frame, belt_speeds=0.5 * plant.speeds)
    (ax,) = panels(plant_figure(plant, slowed, "small_plant"))
    assert "feeder\n0.4 m/s" in {text.get_text() for text in ax.texts}


def test_every_axis_has_a_unit(plant: StaticGeometry, frame: PlantFrame, scene: Scene) -> None:
    for figure in (
        plant_figure(plant, frame, "small_plant"),
        table_figure(plant, [frame], "small_plant"),
        scene_figure(plant, PlantFrame.start_of(scene), "small_plant"),
    ):
        (ax,) = panels(figure)
        (bar,) = [ax for ax in figure.axes if ax.get_label() == "<colorbar>"]
        assert (ax.get_xlabel(), ax.get_ylabel()) == ("x (m)", "y (m)")
        assert (bar.get_xlabel() + bar.get_ylabel()).endswith("(m/s)")


def test_scene_shows_the_initial_bottles_and_names_the_rails(plant: StaticGeometry, scene: Scene) -> None:
    (ax,) = panels(scene_figure(plant, PlantFrame.start_of(scene), "small_plant"))
    assert count(ax, "bottles") == 7
    assert {"top", "bottom", "infeed inlet", "outfeed reject"} <= {text.get_text() for text in ax.texts}


@pytest.mark.parametrize(("panels_of", "bottles", "megabytes"), [(1, 990, 1.0), (4, 240, 1.0), (4, 3000, 2.0)])
def test_many_bottles_and_forces_stay_a_small_svg(
    plant: StaticGeometry, frame: PlantFrame, tmp_path: Path, panels_of: int, bottles: int, megabytes: float
) -> None:
    random = np.random.default_rng(1)
    pitch = np.sqrt(2.0 / bottles)
    row, column = np.divmod(np.arange(bottles), int(2.0 / pitch))
    axes = np.stack([pitch * (column + 0.5 * (row % 2)), pitch * np.sqrt(0.75) * row], axis=1)
    towards = pitch * np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)], [-0.5, np.sqrt(0.75)]])
    lines = np.concatenate([np.stack([axes, axes + step], axis=1) for step in towards])
    contacts = Contacts(lines, random.uniform(1.0, 10.0, 3 * bottles))
    x, y = axes.T
    theta, radius = random.uniform(0.0, 6.0, bottles), np.full(bottles, 0.5 * pitch)
    speed = 1.0 - 0.5 * x
    crowd = PlantFrame(0.0, x, y, theta, radius, speed, frame.belt_speeds, contacts)
    _, svg = style.save(table_figure(plant, [crowd] * panels_of, "crowd"), tmp_path / "crowd")
    assert svg.stat().st_size < 1e6 * megabytes
