# SPDX-License-Identifier: Apache-2.0
"""The main job: node and controller as two processes in lockstep."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from facts import missing, stating
from ros.conftest import SMALL_LINE
from ros.line_client import until
from ros.test_recording import messages

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recover import recover
from conveyor_sim.errors import ConveyorError
from conveyor_sim.ros.main_job import run_in_lockstep
from conveyor_sim.scene import parse_scene


def children_of(process: int) -> list[int]:
    """Process ids."""
    return [int(number) for number in Path(f"/proc/{process}/task/{process}/children").read_text().split()]


@pytest.fixture
def nothing_left() -> Iterator[None]:
    """Check afterwards that this process has no new child (multiprocessing keeps one)."""
    before = children_of(os.getpid())
    yield
    assert set(children_of(os.getpid())) <= set(before)


def command_of(process: int) -> str:
    return Path(f"/proc/{process}/cmdline").read_text().replace("\0", " ")


def start_main_job(bag: Path) -> tuple[subprocess.Popen[str], dict[str, int]]:
    """A main job that will not end soon, and the process ids of its node and its controller, once both are at work."""
    command = [sys.executable, "-m", "conveyor_sim.ros.main_job", str(SMALL_LINE), "--out", str(bag)]
    command += ["--duration", "100000"]
    job = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    until(lambda: bag.is_dir() and sum(file.stat().st_size for file in bag.glob("*.mcap")) > 100_000, "a recording")
    names = ("sim_node", "controller_node")
    return job, {name: child for child in children_of(job.pid) for name in names if name in command_of(child)}


@pytest.mark.usefixtures("nothing_left")
def test_two_runs_give_the_same_bytes_and_the_controller_its_commands(tmp_path: Path) -> None:
    for name in ("one", "two"):
        run_in_lockstep(str(SMALL_LINE), tmp_path / name)
    one = messages(tmp_path / "one")
    assert one == messages(tmp_path / "two")
    assert len(one["signals"]) == 401
    assert len(one["outcomes"]) == 41  # a scan every 10 ticks, and before them the controller takes the line
    with open_bag(tmp_path / "one") as bag:
        assert bag.line.overrides == "duration: 4.0\n"
    assert {path.name for path in (tmp_path / "one" / "logs").iterdir()} == {"sim_node.log", "controller_node.log"}


@pytest.mark.usefixtures("nothing_left")
def test_chosen_parameters_reach_the_node(tmp_path: Path) -> None:
    scene = tmp_path / "line.yaml"
    text = SMALL_LINE.read_text().replace("width: 0.2, speed: 0.5,", "width: 0.2, speed: pace,")
    scene.write_text(f"parameters: {{pace: 0.5 m/s}}\n{text}")
    run_in_lockstep(str(scene), tmp_path / "bag", 0.2, settings=["pace=0.3 m/s"])
    with open_bag(tmp_path / "bag") as bag:
        assert parse_scene(bag.line.scene_text).belts["feeder"].speed == 0.3
    with pytest.raises(ConveyorError, match=stating("parameters.pce", "pace")):
        run_in_lockstep(str(scene), tmp_path / "other", settings=["pce=3 m/s"])


@pytest.mark.usefixtures("nothing_left")
def test_a_scene_without_the_controllers_belts_is_refused_before_anything_starts(tmp_path: Path) -> None:
    with pytest.raises(ConveyorError, match=stating("two_bottles.yaml", "no belt feeder", "no belt table")):
        run_in_lockstep("two_bottles", tmp_path / "bag")
    assert not (tmp_path / "bag").exists()


@pytest.mark.parametrize("victim", ["sim_node", "controller_node"])
def test_a_process_that_is_killed_ends_the_job_with_its_name(tmp_path: Path, victim: str) -> None:
    job, processes = start_main_job(tmp_path / "bag")
    os.kill(processes[victim], signal.SIGKILL)
    output, _ = job.communicate(timeout=60)
    assert job.returncode == 1
    assert missing(output, ["main job", victim, "killed", "signal 9", "log"]) == []
    assert not any(Path(f"/proc/{process}").exists() for process in processes.values())
    assert recover(tmp_path / "bag").healthy == (victim == "controller_node")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_job_leaves_a_whole_bag_and_no_process(tmp_path: Path, number: signal.Signals) -> None:
    job, processes = start_main_job(tmp_path / "bag")
    job.send_signal(number)
    output, _ = job.communicate(timeout=60)
    assert job.returncode == 130
    assert "main job: interrupted at " in output
    assert missing(output, ["recorded", str(tmp_path / "bag")]) == []
    assert not any(Path(f"/proc/{process}").exists() for process in processes.values())
    assert recover(tmp_path / "bag").healthy
