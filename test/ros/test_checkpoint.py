# SPDX-License-Identifier: Apache-2.0
"""The services save_checkpoint and load_checkpoint, over DDS."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conveyor_msgs import srv
from conveyor_msgs.msg import Line
from facts import missing, stating
from ros.conftest import SMALL_LINE
from ros.line_client import LineClient, until
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.errors import BagError
from conveyor_sim.physics.state.checkpoint import to_bytes
from conveyor_sim.ros.child import Child
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

FEEDER = "belts/feeder/cmd_speed"
PLAYING, PAUSED = 1, 2


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the shared node."""
    return tmp_path_factory.mktemp("checkpoints")


@pytest.fixture(scope="module")
def shared_node(start_node: Callable[..., Child], folder: Path) -> Child:
    """One node for many tests, with ticks enough for all, and other threads than the first test's own."""
    return start_node(duration=1000.0, checkpoint_folder=folder, threads=2)


def save(client: LineClient, path: Path | str) -> Any:
    """The response."""
    return client.call(srv.SaveCheckpoint, "save_checkpoint", path=str(path))


def load(client: LineClient, path: Path | str) -> Any:
    """The response."""
    return client.call(srv.LoadCheckpoint, "load_checkpoint", path=str(path))


def scans(client: LineClient, first: int, last: int) -> list[int]:
    """State hashes of scans of 10 ticks, each with a command; the first scan leads to tick `first`."""
    hashes = []
    for target in range(first, last + 1, 10):
        speed = 0.2 + (target % 70) / 100.0
        response = client.lockstep(target, names=[FEEDER], values=[speed], release=target == last)
        assert response.accepted, response.reason
        hashes.append(response.state_hash)
    return hashes


def test_what_was_saved_goes_on_to_the_same_bits(
    start_node: Callable[..., Child],
    client: LineClient,
    folder: Path,
    tmp_path: Path,
    request: pytest.FixtureRequest,
) -> None:
    """In the same node, in another one with other threads, and without ROS. Each run has a separate recording."""
    file = folder / "checkpoint"
    node = start_node(record=tmp_path / "bag", threads=1, checkpoint_folder=folder)
    scans(client, 10, 150)
    with client.listen(Line, "line") as lines:
        began = lines.first()
        saved = save(client, file)
        assert (saved.success, saved.message, saved.tick) == (True, f"saved to {file}", 150)
        assert (saved.time.sec, saved.time.nanosec) == (1, 500_000_000)
        hashes = scans(client, 160, 250)
        lines.messages.clear()
        loaded = load(client, file)
        assert (loaded.success, loaded.message, loaded.tick) == (True, f"loaded {file}", 150)
        line = lines.first()
    assert (began.tick, line.tick) == (0, 150)
    assert line.run_id != began.run_id
    assert client.state() == PAUSED
    assert scans(client, 160, 250) == hashes
    node.stop()
    request.getfixturevalue("shared_node")
    assert load(client, file).success
    assert scans(client, 160, 250) == hashes
    sim = Simulation.load(file, scene=load_scene(SMALL_LINE))
    assert (sim.tick, sim.time) == (150, 1.5)
    report = replay(tmp_path / "bag")
    assert report.difference is None
    assert report.last_tick == 250
    with open_bag(tmp_path / "bag_1") as bag:
        ticks = [frame.tick for frame in bag.signals()]
    assert (ticks[0], ticks[-1]) == (150, 250)
    report = replay(tmp_path / "bag_1")  # from the checkpoint, which lies in it
    assert (report.difference, report.last_tick) == (None, 250)
    (tmp_path / "bag_1" / "start.npz").unlink()
    with pytest.raises(BagError, match=stating(str(tmp_path / "bag_1"), "checkpoint", "tick 150", "tick 0")):
        replay(tmp_path / "bag_1")


def test_a_running_simulation_is_saved_as_it_runs_and_paused_by_a_load(
    line: LineClient, shared_node: Child, folder: Path
) -> None:
    """Time goes back with a load, and on from there."""
    file = folder / "checkpoint"
    line.step(50)
    line.call(Trigger, "resume")
    saved = save(line, file)
    assert saved.success
    until(lambda: line.lockstep(0).tick > saved.tick + 20, "time to pass")
    with line.listen(Clock, "/clock", "clock") as clock:
        loaded = load(line, file)
        assert loaded.success
        assert loaded.tick == saved.tick >= 50
        clock.messages.clear()
        now = clock.first().clock
    assert line.state() == PAUSED
    assert (now.sec, now.nanosec) == (loaded.time.sec, loaded.time.nanosec)
    line.step(1)
    assert line.lockstep(0).tick == loaded.tick + 1
    assert f"loaded {file}: run " in shared_node.log.read_text()


def test_what_can_not_be_loaded_leaves_the_run_as_it_is(line: LineClient, folder: Path) -> None:
    """The lockstep under way too: its owner goes on."""
    (folder / "scene.yaml").write_text("name: a scene\n")
    other = Simulation(load_scene(SMALL_LINE, {"belts": {"table": {"speed": 0.1}}, "duration": 1000.0}))
    other.save(folder / "other")
    with line.listen(Line, "line") as lines:
        lines.first()
        answer = line.lockstep(30, run_id="plc")
        assert answer.accepted
        for name, reason in (
            ("nowhere", f"no such file, expected a checkpoint in {folder}"),
            ("scene.yaml", "not a checkpoint, expected a file that was saved as one"),
            ("other", "saved from a scene with belts.table.speed: 0.1, which is 0.2 in the scene given; "
                      "expected the same scene"),
        ):  # fmt: skip
            response = load(line, folder / name)
            assert (response.success, response.tick) == (False, 30)
            assert response.message == f"{folder / name}: {reason}"
        assert len(lines.messages) == 1
    assert line.lockstep(30, run_id="plc").state_hash == answer.state_hash  # the stored answer: nothing was reset
    assert line.lockstep(40, run_id="plc", release=True).accepted


def test_what_can_not_be_saved_is_told(line: LineClient, folder: Path) -> None:
    line.step(3)
    response = save(line, folder / "no" / "file")
    assert (response.success, response.tick) == (False, 3)
    assert response.message.startswith(f"{folder / 'no' / 'file'}: can't be written (No such file or directory)")
    assert missing(save(line, "").message, ["is a folder", "new name", "checkpoint"]) == []
    (folder / "mine.yaml").write_text("name: mine\n")
    response = save(line, "mine.yaml")
    assert (response.success, response.tick) == (False, 3)
    assert response.message.startswith(f"{folder / 'mine.yaml'}: is not a checkpoint and is not replaced")
    assert (folder / "mine.yaml").read_text() == "name: mine\n"


@pytest.mark.parametrize("ask", [save, load])
def test_a_path_is_repeated_in_printable_words(line: LineClient, ask: Callable[..., Any]) -> None:
    forged = ask(line, "\n[ERROR] forged\x1b[2J" + "x" * 500).message
    assert forged.isprintable()
    assert len(forged) < 500
    assert not ask(line, "~nobody_at_all/x").success
    line.step(1)


def test_a_load_breaks_off_what_is_under_way(line: LineClient, folder: Path) -> None:
    """An advance far ahead is answered, and the owner of the lockstep is no longer one."""
    line.step(5)
    assert save(line, folder / "checkpoint").success
    assert line.lockstep(6, run_id="plc").accepted
    wait = line.client(srv.Lockstep, "lockstep").call_async(srv.Lockstep.Request(run_id="plc", target_tick=90_000))
    until(lambda: line.lockstep(0).tick > 6, "the advance to begin")
    assert load(line, folder / "checkpoint").tick == 5
    answer = until(wait.result, "the answer to the advance")
    assert (answer.accepted, answer.reason) == (False, "a checkpoint was loaded")
    line.step(1)


def test_a_file_is_read_while_the_simulation_goes_on(line: LineClient, folder: Path) -> None:
    """A step that is asked for later is answered before the file is read; a second file is not read beside it."""
    line.step(1)
    with (folder / "large").open("wb") as stream:
        stream.write(b"PK\x03\x04")
        stream.seek(480_000_000)
        stream.write(b"sha256:" + b"0" * 64)
    answer = line.client(srv.LoadCheckpoint, "load_checkpoint").call_async(srv.LoadCheckpoint.Request(path="large"))
    refused = load(line, "large")
    line.step(1)
    assert not answer.done()
    assert refused.tick == 1
    assert missing(refused.message, ["another checkpoint", "being loaded", "answer"]) == []
    response = until(answer.result, "the answer")
    assert missing(response.message, ["large", "checksum"]) == []
    assert response.tick == 2


def test_what_is_no_checkpoint_neither_stops_nor_ends_a_run(line: LineClient, shared_node: Child, folder: Path) -> None:
    """A pipe without a writer, a device without end, a header without its fields, arrays cut short, NaN.

    The last test of the shared node.
    """
    line.step(20)
    assert save(line, "good").success
    with np.load(folder / "good") as file:
        arrays = dict(file)
    header = json.loads(arrays.pop("header").tobytes())
    x = arrays["bottles.x"]

    def written(name: str, header: dict[str, Any], **changes: Any) -> str:
        (folder / name).write_bytes(to_bytes(json.dumps(header), {**arrays, **changes}))
        return name

    os.mkfifo(folder / "pipe")
    (folder / "device").symlink_to("/dev/zero")
    wrong = [
        ("pipe", "is a named pipe, not a regular file"),
        ("device", f"leads out of the folder {folder}"),
        (
            written("no versions", {name: header[name] for name in header if name != "versions"}),
            "header.versions is missing",
        ),
        (written("a number", {**header, "scene": 42}), "header.scene is not of its type"),
        (written("cut short", header, **{"bottles.x": x[:-1]}), "array bottles.x has the shape"),
        (written("not finite", header, **{"bottles.x": np.full_like(x, np.nan)}), "array bottles.x is not finite"),
        ("a\nforged line", "path: 'a\\nforged line' given, expected at most 1000 characters that can be printed"),
    ]
    line.call(Trigger, "resume")
    ticks = [0]
    for path, reason in wrong:
        response = load(line, path)
        assert not response.success
        assert reason in response.message
        assert "\n" not in response.message
        ticks.append(response.tick)
        until(lambda: line.lockstep(0).tick > ticks[-1], "time to pass")
    assert ticks == sorted(ticks)
    assert line.state() == PLAYING
    assert load(line, "good").tick == 20
    shared_node.stop()
    assert shared_node.exit_code == 0
    assert "Traceback" not in shared_node.log.read_text()


def test_both_services_keep_to_their_folder(
    start_node: Callable[..., Child], client: LineClient, tmp_path: Path
) -> None:
    """It is made when it is needed, and neither `..` nor an absolute path nor a link leads out of it."""
    folder, outside = tmp_path / "folder", tmp_path / "outside"
    outside.mkdir()
    node = start_node(checkpoint_folder=folder)
    assert save(client, "good").message == f"saved to {folder / 'good'}"
    (outside / "file").write_bytes((folder / "good").read_bytes())
    (folder / "link").symlink_to(outside)
    for path in ("../outside/file", str(outside / "file"), "link/file", "~/file"):
        for response in (save(client, path), load(client, path)):
            assert not response.success
            assert "~" in path or "leads out of the folder" in response.message
    assert load(client, folder / "good").success
    assert [file.name for file in outside.iterdir()] == ["file"]
    assert {file.name for file in folder.iterdir()} == {"good", "link"}
    node.stop()
    node = start_node(checkpoint_folder="")
    for response in (save(client, "file"), load(client, "file")):
        assert missing(response.message, ["checkpoint_folder", "empty", "folder"]) == []
    node.stop()


def test_a_checkpoint_of_the_end_has_no_way_on_but_a_longer_run(
    start_node: Callable[..., Child], client: LineClient, tmp_path: Path
) -> None:
    node = start_node(record=tmp_path / "bag", duration=0.2, checkpoint_folder=tmp_path)
    client.step(20)
    assert save(client, tmp_path / "checkpoint").success
    (tmp_path / "bag_1").mkdir()
    (tmp_path / "bag_1" / "notes").write_text("not to be mixed up")
    assert "bag_1: is not empty" in load(client, tmp_path / "checkpoint").message
    (tmp_path / "bag_1" / "notes").unlink()
    assert load(client, tmp_path / "checkpoint").tick == 20
    resumed = client.call(Trigger, "resume")
    assert not resumed.success
    assert missing(resumed.message, ["ended", "tick 20", "reset"]) == []
    node.stop()
    with open_bag(tmp_path / "bag_1") as bag:
        assert bag.line.tick == 20
    node = start_node(duration=0.3, checkpoint_folder=tmp_path)
    assert load(client, tmp_path / "checkpoint").tick == 20
    client.step(10)
    node.stop()
