# SPDX-License-Identifier: Apache-2.0
"""A save replaces a checkpoint only: every other file that has its name stays as it is."""

from __future__ import annotations

import json
import os
import threading
from pathlib import Path

import numpy as np
import pytest
from facts import missing
from scenes import bottle, scene

from conveyor_sim.errors import CheckpointError
from conveyor_sim.physics.state.checkpoint import FORMAT
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.files import FileError, write_file

EXPECTED = "expected a new name or a checkpoint"


@pytest.fixture(scope="module")
def sim() -> Simulation:
    """One bottle."""
    return Simulation(scene(bottles=[bottle(0.0, 0.0)]), threads=1)


@pytest.fixture(scope="module")
def content(sim: Simulation, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Return the content of a checkpoint."""
    path = tmp_path_factory.mktemp("checkpoint") / "good.npz"
    sim.save(path)
    return path.read_bytes()


def refusal(sim: Simulation, path: Path, folder: Path | None = None) -> str:
    """Return why a save to a path is refused, without the path. The content of its folder must stay as it is."""
    before = {file.name: file.read_bytes() for file in path.parent.iterdir() if file.is_file()}
    with pytest.raises(CheckpointError) as caught:
        sim.save(path, folder)
    assert {file.name: file.read_bytes() for file in path.parent.iterdir() if file.is_file()} == before
    assert str(caught.value).startswith(f"{path}: ") and EXPECTED in str(caught.value)
    return str(caught.value).removeprefix(f"{path}: ").partition(", expected")[0]


def saved_npz(folder: Path, **arrays: object) -> bytes:
    """Return the content of a .npz."""
    np.savez(folder / "made.npz", **arrays)  # type: ignore[arg-type]
    made = (folder / "made.npz").read_bytes()
    (folder / "made.npz").unlink()
    return made


@pytest.mark.parametrize("inside", [False, True])
def test_a_file_that_is_no_checkpoint_is_not_replaced(
    sim: Simulation, content: bytes, tmp_path: Path, inside: bool
) -> None:
    header = np.frombuffer(json.dumps({"format": 1}).encode(), np.uint8)
    strange = {
        "scene.yaml": b"name: a scene\n",
        "empty": b"",
        "arrays.npz": saved_npz(tmp_path, x=np.zeros(3)),
        "header.npz": saved_npz(tmp_path, header=np.zeros(3)),
        "format.npz": saved_npz(tmp_path, header=header),
        "behind.npz": saved_npz(tmp_path, x=np.zeros(1)) + content,
        "zip": b"PK\x03\x04",
        "cut.npz": content[:100],
        "flipped.npz": content.replace(b'"format"', b'"farmat"', 1),
        "unreadable": os.urandom(2000),
    }
    for name, held in strange.items():
        (tmp_path / name).write_bytes(held)
        found = refusal(sim, tmp_path / name, tmp_path if inside else None)
        assert missing(found, "checkpoint", "replaced") == [], name


def test_a_checkpoint_of_any_format_is_replaced(sim: Simulation, content: bytes, tmp_path: Path) -> None:
    """This includes one that is damaged behind its header; the name does not matter."""
    (tmp_path / "now").write_bytes(content)
    with np.load(tmp_path / "now") as file:
        arrays = dict(file)
    header = json.loads(arrays.pop("header").tobytes())
    for number in (1, FORMAT, FORMAT + 7):
        text = np.frombuffer(json.dumps({**header, "format": number}).encode(), np.uint8)
        (tmp_path / f"format {number}").write_bytes(saved_npz(tmp_path, header=text, **arrays))
    (tmp_path / "scene.yaml").write_bytes(content)
    (tmp_path / "cut").write_bytes(content[: len(content) // 2])
    (tmp_path / "flipped").write_bytes(content[:-200] + b"?" + content[-199:])
    for file in sorted(tmp_path.iterdir()):
        sim.save(file)
        assert Simulation.load(file).tick == sim.tick


def test_a_link_is_replaced_only_if_it_leads_to_a_checkpoint(sim: Simulation, content: bytes, tmp_path: Path) -> None:
    (tmp_path / "text").write_text("mine")
    (tmp_path / "good").write_bytes(content)
    for name, target, reason in (
        ("to text", "text", "is not a checkpoint and is not replaced"),
        ("to nothing", "nowhere", "is a link to a file that does not exist"),
        ("to a device", "/dev/zero", "is a link, and its target is a device, not a regular file"),
        ("round", "round", "can't be written (Too many levels of symbolic links)"),
        ("to itself", ".", "is a folder"),
    ):
        (tmp_path / name).symlink_to(target)
        assert refusal(sim, tmp_path / name) == reason
        assert (tmp_path / name).is_symlink()
    (tmp_path / "to good").symlink_to("good")
    sim.save(tmp_path / "to good")
    assert not (tmp_path / "to good").is_symlink()
    assert (tmp_path / "good").read_bytes() == content


def test_a_file_that_comes_while_a_checkpoint_is_written_stays(tmp_path: Path) -> None:
    """The check is made again when the new file is complete; `objection` stands for the other program."""
    place = tmp_path / "file"
    place.write_bytes(b"old")
    calls = []

    def objection(stream: object) -> str:
        calls.append(stream)
        if len(calls) == 2:
            return "is somebody else's"
        return ""

    with pytest.raises(FileError, match="is somebody else's"):
        write_file(place, b"new", objection=objection)
    assert place.read_bytes() == b"old"
    assert [file.name for file in tmp_path.iterdir()] == ["file"]


def test_two_that_save_under_one_new_name_both_succeed(sim: Simulation, tmp_path: Path) -> None:
    others = [Simulation(sim.scene, threads=1) for _ in range(2)]
    failed: list[CheckpointError] = []

    def save(one: Simulation) -> None:
        try:
            for _ in range(20):
                one.save(tmp_path / "one")
                (tmp_path / "one").unlink(missing_ok=True)
        except CheckpointError as error:
            failed.append(error)

    threads = [threading.Thread(target=save, args=(one,)) for one in others]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failed
    assert [*tmp_path.iterdir()] == []
