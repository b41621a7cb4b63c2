# SPDX-License-Identifier: Apache-2.0
"""Files of pictures: both formats, the same bytes every time, a clear error where they can't be written."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
import pytest
from facts import stating

from conveyor_sim.errors import ConveyorError
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.draw import plot_scene
from conveyor_sim.scene import Scene
from conveyor_sim.support.nice_numbers import nice_above, nice_below


def test_a_scene_is_drawn_as_png_and_svg(scene: Scene, tmp_path: Path) -> None:
    png = plot_scene(scene, tmp_path / "deep" / "small.svg")
    assert png == tmp_path / "deep" / "small.png"
    assert png.read_bytes().startswith(b"\x89PNG")
    assert "<svg" in png.with_suffix(".svg").read_text()


def test_equal_scenes_give_equal_bytes(scene: Scene, tmp_path: Path) -> None:
    one, other = plot_scene(scene, tmp_path / "one"), plot_scene(scene, tmp_path / "other")
    for suffix in (".png", ".svg"):
        assert one.with_suffix(suffix).read_bytes() == other.with_suffix(suffix).read_bytes()


def test_a_name_with_a_dot_keeps_it(scene: Scene, tmp_path: Path) -> None:
    assert plot_scene(scene, tmp_path / "v1.2") == tmp_path / "v1.2.png"


def test_files_carry_no_date_and_no_program(scene: Scene, tmp_path: Path) -> None:
    png = plot_scene(scene, tmp_path / "scene")
    assert b"Software" not in png.read_bytes()
    svg = png.with_suffix(".svg").read_text()
    assert "<dc:date>" not in svg and "<dc:creator>" not in svg


def test_a_folder_that_is_a_file_is_a_clear_error(scene: Scene, tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("")
    with pytest.raises(ConveyorError, match=stating("taken/scene.png", ".svg", "can't be written")):
        plot_scene(scene, tmp_path / "taken" / "scene")


def test_the_users_own_settings_are_neither_used_nor_changed(scene: Scene, tmp_path: Path) -> None:
    plain = plot_scene(scene, tmp_path / "plain").read_bytes()
    with matplotlib.rc_context({"font.size": 20.0, "axes.facecolor": "black"}):
        assert plot_scene(scene, tmp_path / "styled").read_bytes() == plain
        assert matplotlib.rcParams["font.size"] == 20.0


def test_nice_numbers() -> None:
    assert [nice_below(v) for v in (1.0, 1.9, 4.0, 78.0, 0.3)] == [1.0, 1.0, 2.0, 50.0, pytest.approx(0.2)]
    assert [nice_above(v) for v in (1.0, 1.9, 4.0, 78.0, 0.3)] == [1.0, 2.0, 5.0, 100.0, pytest.approx(0.5)]


def test_slow_is_pale_and_fast_is_dark() -> None:
    lightness = style.SPEED(np.linspace(0.0, 1.0, 50))[:, :3] @ np.array([0.2126, 0.7152, 0.0722])
    assert np.all(np.diff(lightness) < 0.0)
