# SPDX-License-Identifier: Apache-2.0
"""The small line, and a recording of it."""

from collections.abc import Callable
from pathlib import Path

import pytest
from bag.small_line import SMALL_LINE, record

from conveyor_sim.scene import Scene, load_scene


@pytest.fixture(scope="session")
def scene() -> Scene:
    """The small line."""
    return load_scene(SMALL_LINE)


@pytest.fixture(scope="session")
def bag(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small line, recorded for 100 ticks. Not to be written to."""
    folder = tmp_path_factory.mktemp("bags") / "small"
    record(scene, folder, 100)
    return folder


@pytest.fixture
def record_line(scene: Scene, tmp_path: Path) -> Callable[[str, int], Path]:
    """Records the small line into a new folder of a name, for some ticks; a chunk is ten of them."""

    def make(name: str, ticks: int) -> Path:
        record(scene, tmp_path / name, ticks, ticks_a_chunk=10)
        return tmp_path / name

    return make
