# SPDX-License-Identifier: Apache-2.0
"""A node whose kernels are not in the cache yet: it says so, answers, and ends when asked to."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from facts import missing
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, SetParameters
from ros.conftest import SMALL_LINE
from ros.line_client import LineClient, until
from simulation_interfaces import srv as standard_srv
from simulation_interfaces.msg import Result, SimulationState

from conveyor_sim.ros.child import Child

CONVEYOR_SIM = (sys.executable, "-c", "from conveyor_sim.cli import main; main()")
COMPILED_LAST = "semi_implicit_euler.advance-*.kernel"


def cold(cache: Path) -> dict[str, str]:
    """An environment with an empty cache."""
    return {**os.environ, "NUMBA_CACHE_DIR": str(cache)}


def finished(cache: Path) -> bool:
    """Return True if compiling has finished."""
    return bool(list(cache.rglob(COMPILED_LAST)))


def child_of(process: int) -> int:
    """The process that compiles for another."""
    tasks = list(Path(f"/proc/{process}/task").glob("*/children"))
    return until(lambda: [int(child) for task in tasks for child in task.read_text().split()], "its child")[0]


@pytest.fixture
def cold_node(domain: int, client: LineClient, tmp_path: Path) -> Iterator[Child]:
    """A node that compiles."""
    until(lambda: not client.node.count_services("conveyor_sim/get_simulation_state"), "the end of the node before")
    given = {"scene": SMALL_LINE, "record": tmp_path / "bag"}
    node = Child("sim_node", given, {**cold(tmp_path / "cache"), "ROS_LOG_DIR": str(tmp_path)}, tmp_path)
    until(lambda: "compiling the kernels for this kind of scene, about " in node.log.read_text(), "its word")
    yield node
    node.stop()


def test_it_answers_while_it_compiles(cold_node: Child, client: LineClient, tmp_path: Path) -> None:
    asked = client.call(standard_srv.GetSimulationState, "get_simulation_state")
    assert (asked.state.state, asked.result.result) == (SimulationState.STATE_STOPPED, Result.RESULT_OK)
    assert asked.result.error_message.startswith("compiling the kernels, ")
    features = client.call(standard_srv.GetSimulatorFeatures, "get_simulator_features").features
    assert "conveyor_sim" in features.custom_info
    values = client.call(GetParameters, "conveyor_sim/get_parameters", names=["scene", "real_time_factor"]).values
    assert (values[0].string_value, values[1].double_value) == (str(SMALL_LINE), 1.0)
    factor = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=2.0)
    factors = [ParameterMessage(name="real_time_factor", value=factor)]
    assert client.call(SetParameters, "conveyor_sim/set_parameters", parameters=factors).results[0].successful
    playing = SimulationState(state=SimulationState.STATE_PLAYING)
    refused = client.call(standard_srv.SetSimulationState, "set_simulation_state", state=playing).result
    assert refused.result == Result.RESULT_INCORRECT_STATE
    assert missing(refused.error_message, ["get_simulation_state", "PAUSED or PLAYING"]) == []
    assert not client.node.count_services("conveyor_sim/lockstep")
    assert not client.node.count_publishers("/clock")
    assert not finished(tmp_path / "cache")
    quitting = SimulationState(state=SimulationState.STATE_QUITTING)
    assert (
        client.call(standard_srv.SetSimulationState, "set_simulation_state", state=quitting).result.result
        == Result.RESULT_OK
    )
    until(lambda: cold_node.exit_code is not None, "the end of the node")
    assert cold_node.exit_code == 0
    assert not finished(tmp_path / "cache")
    assert not (tmp_path / "bag").exists()


def test_ctrl_c_ends_it_inside_the_compiler(cold_node: Child, tmp_path: Path) -> None:
    os.kill(cold_node.pid, signal.SIGINT)
    until(lambda: cold_node.exit_code is not None, "the end of the node")
    assert cold_node.exit_code == 0
    assert "Traceback" not in cold_node.log.read_text()
    assert not finished(tmp_path / "cache")


def test_what_compiles_ends_with_a_node_that_was_killed(cold_node: Child, tmp_path: Path) -> None:
    compiler = child_of(cold_node.pid)
    os.kill(cold_node.pid, signal.SIGKILL)
    until(lambda: not Path(f"/proc/{compiler}/cmdline").exists() or _is_zombie(compiler), "the end of the compiler")
    assert not finished(tmp_path / "cache")


def test_a_compiler_that_dies_is_told_and_replaced(cold_node: Child) -> None:
    os.kill(child_of(cold_node.pid), signal.SIGKILL)
    until(lambda: "has ended early; compiling in this one" in cold_node.log.read_text(), "its word")
    os.kill(cold_node.pid, signal.SIGINT)
    time.sleep(0.5)  # not to be one signal for the operating system
    if cold_node.exit_code is None:  # there is no way to interrupt the compiler
        os.kill(cold_node.pid, signal.SIGINT)
    until(lambda: cold_node.exit_code is not None, "the end of the node")
    assert cold_node.exit_code in (0, -signal.SIGINT)
    assert "Traceback" not in cold_node.log.read_text()


def test_ctrl_c_ends_a_command_inside_the_compiler(tmp_path: Path) -> None:
    command = [*CONVEYOR_SIM, "run", str(SMALL_LINE), "--out", str(tmp_path / "bag")]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=cold(tmp_path / "cache")) as process:
        assert process.stderr is not None
        assert process.stderr.readline().startswith("compiling the kernels for this kind of scene, about ")
        process.send_signal(signal.SIGINT)
        rest = process.stderr.read()
        assert process.wait(60.0) != 0
    assert "Traceback" not in rest, rest
    assert not finished(tmp_path / "cache")
    assert not (tmp_path / "bag").exists()


def test_a_folder_that_cannot_be_recorded_to_is_found_before_compiling(tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "mine").touch()
    command = [*CONVEYOR_SIM, "run", str(SMALL_LINE), "--out", str(tmp_path / "bag")]
    done = subprocess.run(command, capture_output=True, text=True, env=cold(tmp_path / "cache"), check=False)
    assert done.returncode == 1
    (error,) = done.stderr.splitlines()
    assert error.startswith(f"Error: {tmp_path}/bag: ")
    assert missing(error, ["not empty", "new", "empty folder"]) == []
    assert not list((tmp_path / "cache").rglob("*.kernel"))


def _is_zombie(process: int) -> bool:
    """Return True if a process has ended, and its parent has not collected it yet."""
    return " Z " in Path(f"/proc/{process}/stat").read_text()
