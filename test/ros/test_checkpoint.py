"""The services save_checkpoint and load_checkpoint, over DDS."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from conveyor_msgs import srv
from conveyor_msgs.msg import Line
from ros.conftest import SMALL_LINE
from ros.line_client import LineClient, until
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.errors import BagError
from conveyor_sim.ros.child import Child
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

FEEDER = "belts/feeder/cmd_speed"
PAUSED = 2


def save(client: LineClient, path: Path) -> Any:
    """The response."""
    return client.call(srv.SaveCheckpoint, "save_checkpoint", path=str(path))


def load(client: LineClient, path: Path) -> Any:
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
    start_node: Callable[..., Child], client: LineClient, tmp_path: Path
) -> None:
    """In the same node, in another one with other threads, and without ROS; each run has a recording of its own."""
    file = tmp_path / "checkpoint"
    node = start_node(record=tmp_path / "bag", threads=1)
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
    node = start_node(threads=2)
    assert load(client, file).success
    assert scans(client, 160, 250) == hashes
    node.stop()
    sim = Simulation.load(file, scene=load_scene(SMALL_LINE))
    assert (sim.tick, sim.time) == (150, 1.5)
    report = replay(tmp_path / "bag")
    assert report.difference is None
    assert report.last_tick == 250
    with open_bag(tmp_path / "bag_1") as bag:
        ticks = [frame.tick for frame in bag.signals()]
    assert (ticks[0], ticks[-1]) == (150, 250)
    with pytest.raises(BagError, match=r"bag_1: began from a checkpoint at tick 150, expected a run from tick 0"):
        replay(tmp_path / "bag_1")


def test_a_running_simulation_is_saved_as_it_runs_and_paused_by_a_load(
    line: LineClient, shared_node: Child, tmp_path: Path
) -> None:
    """Time goes back with a load, and on from there."""
    file = tmp_path / "checkpoint"
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


def test_what_can_not_be_loaded_leaves_the_run_as_it_is(line: LineClient, tmp_path: Path) -> None:
    """The lockstep under way too: its owner goes on."""
    (tmp_path / "scene.yaml").write_text("name: a scene\n")
    other = Simulation(load_scene(SMALL_LINE, {"belts": {"table": {"speed": 0.1}}, "duration": 1000.0}))
    other.save(tmp_path / "other")
    with line.listen(Line, "line") as lines:
        lines.first()
        answer = line.lockstep(30, run_id="plc")
        assert answer.accepted
        for name, reason in (
            ("nowhere", "no such file, expected a checkpoint"),
            ("scene.yaml", "not a checkpoint, expected a file that was saved as one"),
            ("other", "saved from a scene with belts.table.speed: 0.1, which is 0.2 in the scene given; "
                      "expected the same scene"),
        ):  # fmt: skip
            response = load(line, tmp_path / name)
            assert (response.success, response.tick) == (False, 30)
            assert response.message == f"{tmp_path / name}: {reason}"
        assert len(lines.messages) == 1
    assert line.lockstep(30, run_id="plc").state_hash == answer.state_hash  # the stored answer: nothing was reset
    assert line.lockstep(40, run_id="plc", release=True).accepted


def test_what_can_not_be_saved_is_told(line: LineClient, tmp_path: Path) -> None:
    line.step(3)
    response = save(line, tmp_path / "no" / "file")
    assert (response.success, response.tick) == (False, 3)
    assert response.message.startswith(f"{tmp_path / 'no' / 'file'}: can't be written (No such file or directory)")
    assert "is a folder, expected a file" in save(line, Path()).message


@pytest.mark.parametrize("ask", [save, load])
def test_a_path_is_repeated_in_printable_words(line: LineClient, ask: Callable[..., Any], tmp_path: Path) -> None:
    """And one with the home of nobody is refused as others are."""
    forged = ask(line, tmp_path / "\n[ERROR] forged\x1b[2J" / ("x" * 500)).message
    assert forged.isprintable()
    assert len(forged) < 500
    assert ask(line, Path("~nobody_at_all/x")).message == (
        "path: ~nobody_at_all/x given, which has no home folder; expected a path"
    )
    line.step(1)


def test_a_load_breaks_off_what_is_under_way(line: LineClient, tmp_path: Path) -> None:
    """An advance far ahead is answered, and the owner of the lockstep is no longer one."""
    line.step(5)
    assert save(line, tmp_path / "checkpoint").success
    assert line.lockstep(6, run_id="plc").accepted
    wait = line.client(srv.Lockstep, "lockstep").call_async(srv.Lockstep.Request(run_id="plc", target_tick=90_000))
    until(lambda: line.lockstep(0).tick > 6, "the advance to begin")
    assert load(line, tmp_path / "checkpoint").tick == 5
    answer = until(wait.result, "the answer to the advance")
    assert (answer.accepted, answer.reason) == (False, "a checkpoint was loaded")
    line.step(1)


def test_a_checkpoint_of_the_end_has_no_way_on_but_a_longer_run(
    start_node: Callable[..., Child], shared_node: Child, client: LineClient, tmp_path: Path
) -> None:
    shared_node.stop()
    node = start_node(record=tmp_path / "bag", duration=0.2)
    client.step(20)
    assert save(client, tmp_path / "checkpoint").success
    (tmp_path / "bag_1").mkdir()
    (tmp_path / "bag_1" / "notes").write_text("not to be mixed up")
    assert "bag_1: is not empty" in load(client, tmp_path / "checkpoint").message
    (tmp_path / "bag_1" / "notes").unlink()
    assert load(client, tmp_path / "checkpoint").tick == 20
    resumed = client.call(Trigger, "resume")
    assert (resumed.success, resumed.message) == (False, "the run has ended at tick 20; expected a reset")
    node.stop()
    with open_bag(tmp_path / "bag_1") as bag:
        assert bag.line.tick == 20
    node = start_node(duration=0.3)
    assert load(client, tmp_path / "checkpoint").tick == 20
    client.step(10)
    node.stop()
