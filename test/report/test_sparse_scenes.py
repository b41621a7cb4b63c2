# SPDX-License-Identifier: Apache-2.0
"""Every command takes scenes with nothing in them, with one bottle, one device or one tick."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from facts import missing

from conveyor_sim.cli import main
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import PlantFrame, StaticGeometry
from conveyor_sim.report.figures.views import plant_figure, scene_figure, table_figure
from conveyor_sim.scene import parse_scene

BARE = "name: sparse\nduration: {}\nbottle_types: {{b: {{radius: 0.03, mass: 0.1, material: glass}}}}\n"
BOTTLE = """bottles: [{type: b, position: [0.3, 0.2]}]
contacts: [{between: [glass, glass], stiffness: 5000}]
"""
BELT = """base: [{between: [glass, belt], friction: 0.4}]
belts: {a: {kind: straight, start: [0, 0], angle: 0, length: 1, width: 0.4, speed: 0.5, material: belt}}
"""
SCENES = {
    "nothing": BARE.format(0.05),
    "nothing in one tick": BARE.format(0.01),
    "one bottle in one tick": BARE.format(0.01) + BOTTLE,
    "a belt and a bottle": BARE.format(0.05) + BOTTLE + BELT,
    "an eye": BARE.format(0.05) + "photo_eyes: {e: {from: [0, 0], to: [0, 1]}}\n",
    "an infeed": BARE.format(0.05)
    + "infeeds: {i: {bottle: b, position: [0, 0], direction: 0, speed: 0.5, rate: 1, count: 1}}\n"
    "contacts: [{between: [glass, glass], stiffness: 5000}]\n",
}
ODD = re.compile(r"\bnan\b|\binf\b|\b0\.0 of 0\.0\b|\b0 of 0\b|Traceback", re.IGNORECASE)


def command(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exc_info
    assert not ODD.search(result.output), result.output
    return result.exit_code, result.output


@pytest.mark.parametrize("name", SCENES)
def test_every_command_takes_it(name: str, tmp_path: Path) -> None:
    scene, bag = tmp_path / "sparse.yaml", tmp_path / "bag"
    scene.write_text(SCENES[name])
    assert command("explain", scene)[0] == 0
    assert command("tags", scene, "--csv")[0] == 0
    assert command("tags", scene, "--modbus")[0] == 0
    assert command("run", scene, "--out", bag, "--no-pictures")[0] == 0
    for reader in (("events",), ("replay",), ("recover",)):
        assert command(*reader, bag)[0] == 0
    assert command("view", bag, "--html", tmp_path / "page.html")[0] == 0
    status, said = command("report", bag, "--no-pictures")
    assert status == 0 or "holds no message" in said  # its line counts nothing


@pytest.mark.parametrize("name", SCENES)
def test_what_there_is_is_drawn(name: str) -> None:
    scene = parse_scene(SCENES[name], "sparse.yaml")
    plant, frame = StaticGeometry.of(scene), PlantFrame.start_of(scene)
    with style.look():
        figures = [
            scene_figure(plant, frame, "sparse"),
            plant_figure(plant, frame, "sparse"),
            table_figure(plant, [frame, frame], "sparse"),
        ]
        for figure in figures:
            assert figure.axes[0].get_xlim()[1] > figure.axes[0].get_xlim()[0]
            words = [text.get_gid() for text in figure.axes[0].texts]
            assert ("nothing" in words) == name.startswith("nothing")


def test_an_empty_scene_is_checked_run_and_drawn(tmp_path: Path) -> None:
    scene = tmp_path / "sparse.yaml"
    scene.write_text(SCENES["nothing"])
    assert command("check", scene, "--out", tmp_path)[0] == 0
    assert (tmp_path / "sparse.png").stat().st_size > 0
    assert command("run", scene, "--out", tmp_path / "bag")[0] == 0
    assert {path.stem for path in (tmp_path / "bag" / "pictures").iterdir()} == {"table", "plant", "flow", "force"}


def test_prices_need_bottles(tmp_path: Path) -> None:
    scene = tmp_path / "sparse.yaml"
    scene.write_text(SCENES["nothing"])
    status, said = command("explain", scene, "--price")
    assert status == 1
    assert missing(said, ["no bottle", "--at", "a time with bottles"]) == []


def test_an_accuracy_study_of_nothing_answers(tmp_path: Path) -> None:
    scene = tmp_path / "sparse.yaml"
    scene.write_text(SCENES["nothing"])
    status, said = command("accuracy", scene, "--out", tmp_path / "study")
    assert status == 0
    assert "nothing in the scene can touch" in said
