# SPDX-License-Identifier: Apache-2.0
"""Recordings of scenes in the layout language: the expanded scene, with its source files attached."""

import math
import shutil
import struct
from pathlib import Path

import pytest
from click.testing import CliRunner
from mcap.reader import make_reader
from scenes import SHIPPED

from conveyor_sim.bag.mcap.writer import McapFileWriter
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorded_scene import recorded_scene
from conveyor_sim.bag.recover import recover
from conveyor_sim.bag.replay import replay
from conveyor_sim.bag.sources import write_sources
from conveyor_sim.cli.command import main
from conveyor_sim.errors import BagError, CheckpointError
from conveyor_sim.run.runner import run_scene as run
from conveyor_sim.scene import Scene, load_scene, parse_again, parse_overrides
from conveyor_sim.scene.difference import scene_difference
from conveyor_sim.scene.layout.compose import LANGUAGE
from conveyor_sim.scene.layout.parts import SceneLayout
from conveyor_sim.scene.places import Places
from conveyor_sim.scene.recorded import OVERRIDES_NAME, recorded_source, sources_of
from conveyor_sim.scene.yaml_lines import Document
from conveyor_sim.simulation import Simulation
from conveyor_sim.testing.scenario import Scenario

MATERIALS = """\
contacts:
  - {between: [glass, glass], table: tables/law.csv}
  - {between: [glass, steel], stiffness: 20 kN/m, damping: {law: normal, restitution: 0.5}}
base: [{between: [glass, chain], friction: 0.2}]
bottle_types: {b1: {radius: 33 mm, mass: 350 g, material: glass}}
"""
CELL = """\
parameters: {speed: {default: 0.3 m/s}}
ports: {in: bend.start, out: away.end}
conveyors:
  bend: {path: [{right: 37 deg, radius: 0.5}], width: 0.09, material: chain, speed: speed}
  away: {after: bend, gap: 5 mm, path: [{straight: 0.5}], width: 0.09, material: chain, speed: speed}
"""
PLANT = """\
name: plant
duration: 1
include: materials.yaml
parameters: {length: 0.5 m}
variants: {long: {parameters: {length: 0.8 m}}}
drives: {m1: {speed: 0.3}}
conveyors:
  lane: {start: [0, 0], heading: 11 deg, path: [{straight: length}], width: 0.09, material: chain, drive: m1,
    guides: {clearance: 75 mm, material: steel}}
cells: {block: {use: cells/turn.yaml, after: lane, gap: 5 mm, set: {speed: 0.3 m/s}}}
infeeds: {filler: {along: lane, at: 0.1, bottle: b1, rate: 3 /s}}
photo_eyes: {eye: {along: lane, at: 0.3}}
underlay: {file: hall.png}
"""
PLAIN = """\
name: plain
duration: 0.1
bottle_types: {b: {radius: 0.03, mass: 0.3, material: glass}}
bottles: [{type: b, position: [0, 0]}]
floor: none
"""
HALL = b"\x89PNG\r\n\x1a\n\x00\xff not text"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("plant")
    files = {
        "plant.yaml": PLANT,
        "materials.yaml": MATERIALS,
        "cells/turn.yaml": CELL,
        "tables/law.csv": "overlap,force\n0.001,20\n",
    }
    for name, text in files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    (folder / "hall.png").write_bytes(HALL)
    return folder


@pytest.fixture(scope="module")
def plant(folder: Path) -> Scene:
    return load_scene(folder / "plant.yaml", {"variant": "long", "outputs": {"bottles": 20}})


@pytest.fixture(scope="module")
def recorded(plant: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    bag = tmp_path_factory.mktemp("runs") / "bag"
    run(plant, bag)
    return bag


@pytest.fixture
def bag(recorded: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(recorded, tmp_path / "bag"))


def mcap_of(bag: Path) -> Path:
    return next(bag.glob("*.mcap"))


@pytest.mark.parametrize("path", SHIPPED, ids=str)
def test_a_scene_is_read_again_from_its_expanded_text(path: Path) -> None:
    scene = load_scene(path)
    text, overrides = recorded_source(scene)
    again = parse_again(text, "recorded", parse_overrides(overrides))
    assert scene_difference(scene, again) is None
    assert not again.is_expanded or not scene.is_expanded
    assert recorded_source(again)[0] == text


def test_the_line_message_holds_the_expanded_scene(recorded: Path, plant: Scene) -> None:
    with open_bag(recorded) as bag:
        line = bag.line
        scene = recorded_scene(line, "recorded")
    data = Document(line.scene_text, "recorded").data
    assert not {*LANGUAGE, *SceneLayout.model_fields} & set(data)
    assert data["rails"] and data["belts"]["block_bend"]["turn"] == "right"
    assert data["seed"] == 0 and data["belts"]["block_away"]["speed_limits"] == [-3.0, 3.0]
    assert scene_difference(scene, plant, ["accuracy"]) is None
    assert scene.layout is None and scene.underlay_url == plant.underlay_url
    assert Places(scene).of(("photo_eyes", "eye")).startswith("recorded:")


def test_a_recording_replays_exactly(recorded: Path) -> None:
    report = replay(recorded)
    assert report.exact and report.difference is None
    assert report.compared["bottles"] > 10


def test_a_scene_without_layout_keeps_its_text_and_has_no_sources(tmp_path: Path) -> None:
    (tmp_path / "line.yaml").write_text(PLAIN)
    scene = load_scene(tmp_path / "line.yaml", {"seed": 3})
    assert recorded_source(scene) == (PLAIN, "seed: 3\n")
    assert sources_of(scene) == {}


def test_texts_with_units_alone_are_recorded_as_numbers() -> None:
    scene = parse_again(PLAIN, "line.yaml", {"tick": "10 ms"})
    assert scene.is_expanded
    assert Document(recorded_source(scene)[0], "recorded").data["tick"] == 0.01


def test_sources_are_attachments_of_the_file(recorded: Path, folder: Path) -> None:
    with mcap_of(recorded).open("rb") as stream:
        attached = {one.name: one for one in make_reader(stream).iter_attachments()}
    assert set(attached) == {
        "plant.yaml", "materials.yaml", "cells/turn.yaml", "tables/law.csv", "hall.png", OVERRIDES_NAME,
    }  # fmt: skip
    assert attached["plant.yaml"].data.decode() == PLANT
    assert (attached["hall.png"].data, attached["hall.png"].media_type) == (HALL, "image/png")


def test_the_command_sources_writes_a_scene_that_reads_the_same(recorded: Path, plant: Scene, tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = CliRunner().invoke(main, ["sources", str(recorded), "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert (out / "hall.png").read_bytes() == HALL
    overrides = parse_overrides((out / OVERRIDES_NAME).read_text())
    assert scene_difference(load_scene(out / "plant.yaml", overrides), plant) is None
    with pytest.raises(BagError, match="is not empty"):
        write_sources(recorded, out)


def test_a_recording_without_sources_is_refused(tmp_path: Path) -> None:
    run(parse_again(PLAIN, "line.yaml", {}), tmp_path / "bag")
    with pytest.raises(BagError, match="no sources"):
        write_sources(tmp_path / "bag", tmp_path / "out")


def test_a_damaged_attachment_is_reported_and_left_out(bag: Path, tmp_path: Path) -> None:
    file = mcap_of(bag)
    content = file.read_bytes()
    file.write_bytes(content.replace(b"radius: 33 mm", b"radius: 63 mm", 1))
    result = write_sources(bag, tmp_path / "out")
    assert "materials.yaml" not in result.written and len(result.refused) == 1
    assert "materials.yaml" in result.refused[0]
    with pytest.raises(BagError, match=r"materials\.yaml is damaged"):
        open_bag(bag)
    report = recover(bag)
    assert not report.healthy
    assert set(write_sources(bag, tmp_path / "again").written) == set(result.written)
    assert replay(bag).difference is None


def test_an_interrupted_recording_has_its_sources(bag: Path, tmp_path: Path) -> None:
    file = mcap_of(bag)
    content = file.read_bytes()
    file.write_bytes(content[: len(content) * 2 // 3])
    recover(bag)
    assert (tmp_path / "bag").is_dir() and "plant.yaml" in write_sources(bag, tmp_path / "out").written


@pytest.mark.parametrize("name", ["../../x", "/tmp/conveyor_x", "..", "", "a/../../x", "x\0y", "n" * 300, "."])
def test_an_attachment_never_leaves_the_folder(tmp_path: Path, name: str) -> None:
    file = tmp_path / "deep" / "er" / "bag.mcap"
    file.parent.mkdir(parents=True)
    with file.open("wb") as stream:
        writer = McapFileWriter(stream, file.name, "jazzy")
        writer.add_attachment(name, "text/plain", b"bad", 0, 0)
        writer.add_attachment("good.yaml", "text/plain", b"good", 0, 0)
        writer.add_attachment("good.yaml", "text/plain", b"twice", 0, 0)
        writer.add_attachment("good.yaml/below", "text/plain", b"below", 0, 0)
        writer.finish()
    before = {path for path in tmp_path.rglob("*") if path != file}
    result = write_sources(file, tmp_path / "deep" / "er" / "out")
    assert result.written == ("good.yaml",) and len(result.refused) == 3
    out = file.parent / "out"
    assert {path for path in tmp_path.rglob("*") if path not in before} == {file, out, out / "good.yaml"}
    assert (out / "good.yaml").read_bytes() == b"good"
    assert not Path("/tmp/conveyor_x").exists()


def test_an_attachment_of_a_false_size_is_damage(bag: Path, tmp_path: Path) -> None:
    file = mcap_of(bag)
    content = bytearray(file.read_bytes())
    at = content.index(PLANT.encode()[:40])
    content[at - 8 : at] = struct.pack("<Q", 2**62)
    file.write_bytes(content)
    with pytest.raises(BagError):
        open_bag(bag)
    with pytest.raises(BagError, match="is damaged"):
        write_sources(bag, tmp_path / "out")
    assert not recover(bag).healthy
    assert replay(bag).difference is None


def test_a_checkpoint_holds_the_expanded_scene(plant: Scene, folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "half.npz"
    simulation = Simulation(plant)
    simulation.advance(50)
    simulation.save(path)
    for scene in (None, plant):
        again = Simulation.load(path, scene=scene)
        again.advance(50)
        simulation = Simulation(plant)
        simulation.advance(100)
        assert again.state_hash() == simulation.state_hash()
    assert not Simulation.load(path).scene.is_expanded
    other = load_scene(folder / "plant.yaml", {"outputs": {"bottles": 20}})
    with pytest.raises(CheckpointError, match=r"belts\.lane\.length"):
        Simulation.load(path, scene=other)


def test_a_run_from_a_checkpoint_replays_and_keeps_its_sources(plant: Scene, tmp_path: Path) -> None:
    start, bag = tmp_path / "start.npz", tmp_path / "bag"
    simulation = Simulation(plant)
    simulation.advance(20)
    simulation.save(start)
    with Scenario(plant, start=start, bag=bag) as scenario:
        scenario.run_for(0.5)
    assert replay(bag).difference is None
    assert "cells/turn.yaml" in write_sources(bag, tmp_path / "out").written


def test_every_number_of_the_text_is_exact(plant: Scene) -> None:
    again = parse_again(recorded_source(plant)[0], "recorded", {})
    for name, belt in plant.belts.items():
        assert again.belts[name] == belt
    angle = plant.belts["lane"].angle  # type: ignore[union-attr]
    assert angle == math.radians(11.0)
