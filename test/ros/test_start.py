# SPDX-License-Identifier: Apache-2.0
"""Parameters at start: what they switch off, and what can't be started."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import sysconfig
from collections.abc import Callable
from pathlib import Path

import pytest
from facts import missing
from ros.conftest import SMALL_LINE
from ros.line_client import LineClient, until
from simulation_interfaces.msg import SimulationState
from simulation_interfaces.srv import SetSimulationState

from conveyor_sim.ros.child import Child

ROOT = Path(__file__).parents[2]


def test_the_clock_can_be_switched_off(start_node: Callable[..., Child], client: LineClient) -> None:
    node = start_node(publish_clock=False)
    client.diagnostics()
    assert not client.node.count_publishers("/clock")
    node.stop()


def test_a_request_to_quit_is_answered_and_followed(start_node: Callable[..., Child], client: LineClient) -> None:
    node = start_node()
    quitting = SimulationState(state=SimulationState.STATE_QUITTING)
    result = client.call(SetSimulationState, "set_simulation_state", state=quitting).result
    assert result.result == result.RESULT_OK
    until(lambda: node.exit_code is not None, "the end of the node")
    assert node.exit_code == 0


@pytest.mark.parametrize(
    ("parameters", "sentence"),
    [
        ({"record": "/proc/no_such_folder/bag"}, "/proc/no_such_folder/bag: can't be created"),
        ({"scene": "no_such_scene"}, "no_such_scene: no such scene file"),
        ({"real_time_factor": -2.0}, "parameter real_time_factor: -2.0 given, expected a number from 0"),
        ({"rates.bottles": 33.0}, "outputs.bottles: 33"),
    ],
    ids=["record", "scene", "parameter", "rate"],
)
def test_a_start_that_cannot_be_ends_with_one_sentence(
    domain: int, parameters: dict[str, object], sentence: str, tmp_path: Path
) -> None:
    """Before anything is compiled."""
    command = [sys.executable, "-m", "conveyor_sim.ros.sim_node", "--ros-args"]
    for name, value in {"scene": SMALL_LINE, **parameters}.items():
        command += ["-p", f"{name}:={value}"]
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, env=environment, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("sim_node: ")
    assert sentence in done.stderr
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.rglob("*.kernel"))


@pytest.mark.parametrize(
    ("program", "package", "remedy"),
    [
        ("sim_node", "simulation_interfaces", "ros-jazzy-simulation-interfaces"),
        ("sim_node", "conveyor_msgs", "colcon"),
        ("sim_node", "rclpy", "ros-jazzy-rclpy"),
        ("controller_node", "conveyor_msgs", "colcon"),
    ],
)
def test_a_missing_package_ends_a_node_with_one_sentence(
    program: str, package: str, remedy: str, tmp_path: Path
) -> None:
    """In an environment of links to all installed modules but one."""
    for module in Path(sysconfig.get_path("purelib")).iterdir():
        if module.name != package:
            (tmp_path / module.name).symlink_to(module)
    environment = {**os.environ, "PYTHONPATH": f"{tmp_path}:{ROOT}", "ROS_DISTRO": "jazzy"}
    command = [sys.executable, "-S", "-m", f"conveyor_sim.ros.{program}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, env=environment, check=False)
    assert (done.returncode, len(done.stderr.splitlines())) == (1, 1), done.stderr
    assert done.stderr.startswith(f"{program}: ")
    assert missing(done.stderr, package, remedy, "make") == []


def test_scene_speed_and_largest_force_are_logged(start_node: Callable[..., Child], client: LineClient) -> None:
    """In one line each, without a word about integrators: the setting is logged at level debug."""
    node = start_node(duration=4.0, start_paused=False)
    until(lambda: "end of the run" in node.log.read_text(), "the end of the run")
    greeting, end = (
        next(line for line in node.log.read_text().splitlines() if words in line)
        for words in ("scene small_line", "end of the run")
    )
    assert ", playing, run " in greeting
    assert "leapfrog" not in node.log.read_text()
    assert "end of the run, 4 s simulated in " in end
    assert " x real time; peak force " in end
    node.stop()
    assert "stopped, " not in node.log.read_text()


def test_a_run_that_is_stopped_tells_how_far_it_came(start_node: Callable[..., Child], client: LineClient) -> None:
    node = start_node(duration=1000.0, start_paused=False)
    until(lambda: int(client.diagnostics()[1]["tick"]) > 0, "the first ticks")
    node.stop()
    assert re.search(r"stopped, [\d.]+ s simulated in [\d.]+ s, ", node.log.read_text())
