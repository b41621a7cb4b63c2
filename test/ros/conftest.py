# SPDX-License-Identifier: Apache-2.0
"""Nodes under test are processes of their own, in a ROS domain that each test module has for itself."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")

from ros.line_client import LineClient, until
from ros.warm_child import WarmChild
from std_srvs.srv import Trigger

from conveyor_sim.bag.messages.typestore import default_distro
from conveyor_sim.ros.child import Child
from conveyor_sim.ros.domain import private_domain
from conveyor_sim.run.active_run import ActiveRun
from conveyor_sim.run.session import RunSession
from conveyor_sim.run.stepper import Stepper
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

SMALL_LINE = Path(__file__).with_name("small_line.yaml")


@pytest.fixture(scope="module")
def domain() -> Iterator[int]:
    """A ROS domain for this module's processes."""
    with private_domain() as number:
        yield number


@pytest.fixture(scope="module")
def start_node(client: LineClient, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., Child]]:
    """Starts `sim_node` with ROS parameters: unless they say else on the small line, paused, as fast as possible.

    Returns when its run has started, however long its kernels take to compile. One at a time: the one before must have
    been stopped.
    """
    children: list[Child] = []

    def start(**parameters: object) -> Child:
        assert all(child.exit_code is not None for child in children)
        until(lambda: not client.node.count_services("conveyor_sim/lockstep"), "the end of the node before")
        given = {"scene": SMALL_LINE, "start_paused": True, "real_time_factor": 0.0, **parameters}
        logs = tmp_path_factory.mktemp("logs")
        child = WarmChild("sim_node", given, {**os.environ, "ROS_LOG_DIR": str(logs / "ros")}, logs)
        children.append(child)
        while child.exit_code is None and client.compiling():
            time.sleep(0.05)
        assert child.exit_code is None, child.obituary()
        return child

    yield start
    for child in children:
        child.stop()


@pytest.fixture(scope="module")
def client(domain: int) -> Iterator[LineClient]:
    """Another participant of the domain."""
    line_client = LineClient()
    yield line_client
    line_client.close()


@pytest.fixture(scope="module")
def shared_node(start_node: Callable[..., Child]) -> Child:
    """One node for many tests of a module, with ticks enough for all."""
    return start_node(duration=1000.0)


@pytest.fixture
def line(shared_node: Child, client: LineClient) -> LineClient:
    """The shared node, paused at tick 0."""
    client.call(Trigger, "pause")
    client.reset()
    return client


class NullSink:
    """A sink that wants no topic."""

    def wants(self, topic: str) -> bool:
        return False

    def write(self, topic: str, data: bytes, stamp_ns: int) -> None:
        raise AssertionError(topic)


@pytest.fixture
def stepper() -> Iterator[Stepper]:
    """Paused, and not started."""
    scene = load_scene(SMALL_LINE)
    run = ActiveRun(
        lambda runs, loaded: RunSession(Simulation(scene), NullSink(), None, "world", default_distro()),
        playing=False,
        lockstep_max_ticks=1,
        log=logging.getLogger(__name__),
    )
    made = Stepper(run, real_time_factor=0.0, beat=lambda stamp_ns, now: None, died=lambda error: None)
    yield made
    made.shutdown()
