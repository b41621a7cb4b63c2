# SPDX-License-Identifier: Apache-2.0
"""A small plant with one of everything, and a frame of it, for the pictures."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes

from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Contacts, PlantFrame, StaticGeometry
from conveyor_sim.scene import Scene, load_scene

SCENE = Path(__file__).with_name("small_plant.yaml")


@pytest.fixture
def scene() -> Scene:
    return load_scene(SCENE)


@pytest.fixture
def plant(scene: Scene) -> StaticGeometry:
    return StaticGeometry.of(scene)


@pytest.fixture
def frame(plant: StaticGeometry) -> PlantFrame:
    """Two bottles that touch on the table, the second also at the rail `top`; a third on the feeder."""
    return PlantFrame(
        time=2.5,
        x=np.array([0.6, 0.7, -1.0]),
        y=np.array([0.951, 0.952, 0.5]),
        theta=np.array([0.0, np.pi / 2, np.pi]),
        radius=np.array([0.05, 0.05, 0.08]),
        speed=np.array([0.0, 0.1, 0.8]),
        belt_speeds=plant.speeds,
        contacts=Contacts(
            lines=np.array([[[0.6, 0.951], [0.7, 0.952]], [[0.7, 0.952], [0.7, 1.0]]]), force=np.array([10.0, 40.0])
        ),
    )


@pytest.fixture
def ax() -> Iterator[Axes]:
    with style.look():
        yield style.new_figure(6.0, 6.0).subplots()
