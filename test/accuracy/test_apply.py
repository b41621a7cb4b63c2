# SPDX-License-Identifier: Apache-2.0
"""A setting written into a copy of a scene."""

from __future__ import annotations

import difflib
from pathlib import Path

import pytest
from facts import stating
from test_scene_options import SCENE as VERSIONS

from conveyor_sim.accuracy.report.apply import apply
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.errors import ConveyorError
from conveyor_sim.scene import load_scene
from conveyor_sim.scene.choices import choices
from conveyor_sim.support.resources import scene_path

VERLET = Setting("velocity_verlet", 123)


def changed(before: str, after: str) -> list[str]:
    """The lines that differ, with + and -."""
    lines = difflib.unified_diff(before.splitlines(), after.splitlines(), n=0, lineterm="")
    return [line for line in lines if line[:3] not in ("---", "+++") and not line.startswith("@@")]


@pytest.mark.parametrize("name", ["paper_plant", "funnel", "two_bottles"])
def test_only_the_accuracy_changes(name: str, tmp_path: Path) -> None:
    """Scenes with a mapping over several lines, and with none; every other line stays, comments and all."""
    scene = load_scene(scene_path(name))
    written = apply(scene, VERLET, tmp_path / "copy.yaml")
    lines = changed(scene.source_text, (tmp_path / "copy.yaml").read_text())
    assert [line for line in lines if line.startswith("+")] == [
        "+accuracy: {integrator: velocity_verlet, per_tick: 123}"
    ]
    removed = [line for line in lines if line.startswith("-")]
    assert all("accuracy" in line or "integrator" in line or "per_tick" in line for line in removed)
    assert (written.accuracy.integrator, written.accuracy.per_tick) == ("velocity_verlet", 123)
    assert written.model_copy(update={"accuracy": scene.accuracy}) == scene


def test_a_word_is_replaced_and_an_error_written(tmp_path: Path) -> None:
    file = tmp_path / "scene.yaml"
    text = load_scene(scene_path("two_bottles")).source_text
    file.write_text(text.replace("duration:", "accuracy: fine\n# between\nduration:"))
    written = apply(load_scene(file), Setting("dormand_prince", 7, error=1e-5), tmp_path / "copy.yaml")
    assert "accuracy: {integrator: dormand_prince, per_tick: 7, error: 1e-05}\n# between\n" in written.source_text
    assert (written.accuracy.preset, written.accuracy.error) == (None, 1e-5)


def test_chosen_parameters_and_format_are_in_the_copy(tmp_path: Path) -> None:
    """The copy is expanded: it needs no choice, and is the same line with the setting."""
    file = tmp_path / "plant.yaml"
    file.write_text(VERSIONS, encoding="utf-8")
    scene = load_scene(file, choices({"length": "3 m"}, None, "fast"))
    written = apply(scene, VERLET, tmp_path / "out" / "plant.yaml")
    assert (written.accuracy.integrator, written.accuracy.per_tick) == ("velocity_verlet", 123)
    assert written.belts == scene.belts != load_scene(file).belts
    assert "length: 3 m" in (tmp_path / "out" / "plant.yaml").read_text()


def test_tables_are_found_from_the_copy(tmp_path: Path) -> None:
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes" / "law.csv").write_text("overlap,force\n0.001,5\n")
    text = load_scene(scene_path("two_bottles")).source_text
    file = tmp_path / "scenes" / "scene.yaml"
    file.write_text(text.replace("stiffness: 5000           # N/m", "table: law.csv"))
    written = apply(load_scene(file), VERLET, tmp_path / "elsewhere" / "deep" / "copy.yaml")
    assert written.contacts[0].table == ((0.001, 5.0),)


def test_what_can_t_be_written_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "scene.yaml"
    file.write_text(load_scene(scene_path("two_bottles")).source_text)
    scene = load_scene(file)
    with pytest.raises(ConveyorError, match="is the scene itself"):
        apply(scene, VERLET, file)
    with pytest.raises(ValueError, match="stiffness"):
        apply(scene, Setting("velocity_verlet", 1, 0.5), tmp_path / "copy.yaml")
    (tmp_path / "file").write_text("")
    with pytest.raises(ConveyorError, match=stating("copy.yaml", "can't be written")):
        apply(scene, VERLET, tmp_path / "file" / "copy.yaml")
    assert file.read_text() == scene.source_text
