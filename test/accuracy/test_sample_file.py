# SPDX-License-Identifier: Apache-2.0
"""Finished runs on disk: read back as they were, cut where a kill cut, refused where they are of something else."""

import json
import math
import os
from pathlib import Path

import pytest
from facts import stating
from scenes import belt, scene

from conveyor_sim.accuracy.measure.observables import OBSERVABLES
from conveyor_sim.accuracy.measure.sample_file import ORIGIN, SAMPLES, SampleFile, check_origin
from conveyor_sim.accuracy.results import Sample
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.errors import ConveyorError
from conveyor_sim.scene import Scene, parse_scene
from conveyor_sim.support.checked_json import with_checksum

SCENE = scene()
NAMES = [observable.name for observable in OBSERVABLES]
MADE = [
    Sample(Setting("semi_implicit_euler", 250), 0, dict.fromkeys(NAMES, 0.1 + 0.2), 1e-3, ""),
    Sample(Setting("dormand_prince", 4, 0.01, 1e-9), 2**64 - 1, {NAMES[1]: 1e300, NAMES[3]: -0.0}, math.pi, ""),
    Sample(Setting("velocity_verlet", 7, 1.0 / 3.0), 5, {}, 0.0, 'unstable, "far" too'),
]


def written(folder: Path) -> bytes:
    """All samples added to the file; what is in it then."""
    file = SampleFile(folder, SCENE)
    for sample in MADE:
        file.append(sample)
    file.close()
    return (folder / SAMPLES).read_bytes()


def read(folder: Path, of: Scene = SCENE) -> list[Sample]:
    file = SampleFile(folder, of)
    file.close()
    return file.found


def test_samples_are_read_as_they_were_written(tmp_path: Path) -> None:
    """To the last bit, and more can be added."""
    content = written(tmp_path)
    assert read(tmp_path) == MADE
    assert (tmp_path / SAMPLES).read_bytes() == content
    assert written(tmp_path).startswith(content)
    assert read(tmp_path) == MADE * 2


def test_a_finished_run_is_on_disk_at_once(tmp_path: Path) -> None:
    file = SampleFile(tmp_path, SCENE)
    for count, sample in enumerate(MADE, start=1):
        file.append(sample)
        assert len((tmp_path / SAMPLES).read_bytes().splitlines()) == 1 + count
    file.close()


def test_a_line_that_was_cut_short_is_dropped_wherever_it_was_cut(tmp_path: Path) -> None:
    content = written(tmp_path)
    heading = content.index(b"\n") + 1
    for length in range(len(content) + 1):
        (tmp_path / SAMPLES).write_bytes(content[:length])
        whole = content[:length].count(b"\n")
        assert read(tmp_path) == MADE[: max(0, whole - 1)]
        kept = (tmp_path / SAMPLES).read_bytes()
        assert kept == content[: max(heading, content[:length].rfind(b"\n") + 1)]


def test_runs_of_something_else_are_refused(tmp_path: Path) -> None:
    written(tmp_path)
    for other in (scene(gravity=9.8), parse_scene(SCENE.source_text, overrides={"seed": 3})):
        with pytest.raises(ConveyorError, match=stating("origin.json", "runs", "another scene", "emptied")):
            SampleFile(tmp_path, other)
    origin = json.loads((tmp_path / ORIGIN).read_text())
    del origin["sha256"]
    (tmp_path / ORIGIN).write_bytes(with_checksum({**origin, "engine": "0", "definition of observables": "0"}))
    with pytest.raises(ConveyorError, match=stating("another engine", "another definition of observables")):
        SampleFile(tmp_path, SCENE)
    (tmp_path / ORIGIN).write_text("{}")
    with pytest.raises(ConveyorError, match=stating("another scene", "another engine")):
        SampleFile(tmp_path, SCENE)
    (tmp_path / ORIGIN).write_text(json.dumps(origin))
    with pytest.raises(ConveyorError, match="another version of conveyor_sim"):
        SampleFile(tmp_path, SCENE)
    for broken in ("[]", "{", "", "[" * 100_000, json.dumps({**origin, "sha256": "0" * 64})):
        (tmp_path / ORIGIN).write_text(broken)
        with pytest.raises(ConveyorError, match=stating("origin.json", "origin of the runs", "unknown")):
            SampleFile(tmp_path, SCENE)
    (tmp_path / ORIGIN).unlink()
    with pytest.raises(ConveyorError, match=stating("origin.json", "no such file", "origin of the runs")):
        SampleFile(tmp_path, SCENE)


def test_a_scene_is_told_by_what_it_says_not_by_its_place(tmp_path: Path) -> None:
    written(tmp_path)
    assert read(tmp_path, parse_scene(SCENE.source_text, "elsewhere.yaml")) == MADE


def test_a_folder_without_runs_is_of_one_scene_too(tmp_path: Path) -> None:
    folder = tmp_path / "deep" / "new"
    check_origin(folder, SCENE)
    check_origin(folder, SCENE)
    with pytest.raises(ConveyorError, match="another scene"):
        check_origin(folder, scene(belts={"belt": belt(0.1)}, base=[{"between": ["glass", "chain"], "friction": 0.1}]))


def test_a_file_of_another_kind_is_refused_and_left_alone(tmp_path: Path) -> None:
    content = written(tmp_path)
    for strange, reason in (
        (b"a,b\n1,2\n", "not a file of finished runs"),
        (content + b"\xff\n", "not a file of finished runs"),
        (content + b"1,2\n", "line 5 of 5: not a finished run"),
        (content.replace(b",0,", b",x,"), "line 2 of 4: not a finished run"),
    ):
        (tmp_path / SAMPLES).write_bytes(strange)
        with pytest.raises(ConveyorError, match=rf"samples\.csv: {reason}"):
            SampleFile(tmp_path, SCENE)
        assert (tmp_path / SAMPLES).read_bytes() == strange


def test_every_flipped_bit_of_a_line_is_found(tmp_path: Path) -> None:
    """Or the line is dropped as one that was cut short, and its run is made again."""
    content = written(tmp_path)
    for place in range(content.index(b"\n") + 1, len(content)):
        damaged = bytearray(content)
        damaged[place] ^= 1 << place % 8
        (tmp_path / SAMPLES).write_bytes(damaged)
        try:
            found = read(tmp_path)
        except ConveyorError as error:
            assert "samples.csv: " in str(error)
        else:
            assert found == MADE[: len(found)]


def test_lines_of_another_scene_are_refused(tmp_path: Path) -> None:
    written(tmp_path)
    other = scene(gravity=9.8)
    SampleFile(tmp_path / "other", other).close()
    (tmp_path / "other" / SAMPLES).write_bytes((tmp_path / SAMPLES).read_bytes())
    with pytest.raises(ConveyorError, match=stating("line 2 of 4", "not a finished run", "this scene")):
        SampleFile(tmp_path / "other", other)


def test_the_folder_of_a_sweep_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "study.json").write_text("{}")
    with pytest.raises(ConveyorError, match="has another kind of study"):
        check_origin(tmp_path, SCENE)
    assert [file.name for file in tmp_path.iterdir()] == ["study.json"]


def test_a_folder_that_can_not_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ConveyorError, match=stating(str(tmp_path / "file"), "File exists", "folder")):
        SampleFile(tmp_path / "file", SCENE)
    (tmp_path / "folder").mkdir()
    check_origin(tmp_path / "folder", SCENE)
    (tmp_path / "folder" / SAMPLES).mkdir()
    with pytest.raises(ConveyorError, match=stating("samples.csv", "is a folder", "finished runs")):
        SampleFile(tmp_path / "folder", SCENE)
    (tmp_path / "folder" / SAMPLES).rmdir()
    os.mkfifo(tmp_path / "folder" / SAMPLES)
    with pytest.raises(ConveyorError, match=r"samples\.csv: is a named pipe"):
        SampleFile(tmp_path / "folder", SCENE)
