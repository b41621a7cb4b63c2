# SPDX-License-Identifier: Apache-2.0
"""The stepping thread, and what waits for it."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from conveyor_msgs import srv
from ros.line_client import LineClient, until
from simulation_interfaces import srv as standard_srv

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.messages.typestore import default_distro, typestore
from conveyor_sim.bag.recover import recover
from conveyor_sim.errors import SimulationError
from conveyor_sim.line.commands.inputs import CommandOutcome
from conveyor_sim.ros.child import Child
from conveyor_sim.run.active_run import ActiveRun
from conveyor_sim.run.calls import MOST_CALLS
from conveyor_sim.run.lockstep import LockstepRequest, Refused, SentInputs
from conveyor_sim.run.session import RunSession
from conveyor_sim.run.stepper import Stepper
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation


def test_so_many_requests_may_wait(stepper: Stepper) -> None:
    waiting = [stepper.call(lambda: None) for _ in range(MOST_CALLS)]
    with pytest.raises(Refused, match="100 requests wait for their answers already"):
        stepper.call(lambda: None).result()
    stepper.start()
    for future in waiting:
        future.result(60.0)
    assert stepper.call(lambda: 7).result(60.0) == 7


def test_the_end_does_not_wait_for_requests(stepper: Stepper) -> None:
    begun, go_on, done = threading.Event(), threading.Event(), list[int]()
    stepper.call(lambda: (begun.set(), go_on.wait(60.0)))
    for number in range(10):
        stepper.call(lambda number=number: done.append(number))
    stepper.start()
    begun.wait(60.0)
    end = threading.Thread(target=stepper.shutdown)
    end.start()
    time.sleep(0.5)  # until it has asked for the end
    go_on.set()
    end.join(60.0)
    assert done == []


def test_a_flood_of_requests_is_refused_and_does_not_hold_up_the_end(
    start_node: Callable[..., Child], client: LineClient, tmp_path: Path
) -> None:
    """Each reset makes a recording; they were carried out for half a minute, and Ctrl-C waited for them."""
    node = start_node(record=tmp_path / "bag")
    resets, faults = (
        client.client(standard_srv.ResetSimulation, "reset_simulation"),
        client.client(srv.InjectFault, "inject_fault"),
    )
    futures: list[Any] = []
    sent = 0

    def refusals() -> list[type]:
        answers = [future.result() for future in futures if future.done()]
        return [type(answer) for answer in answers if "100 requests wait for their answers" in str(answer)]

    def flooded() -> bool:
        return set(refusals()) == {standard_srv.ResetSimulation.Response, srv.InjectFault.Response}

    # On a busy machine the node may answer as fast as requests are sent, for a while.
    while sent < 300 or (sent < 3000 and not flooded()):
        futures.append(resets.call_async(standard_srv.ResetSimulation.Request()))
        sent += 1
        if sent % 5 == 0:
            futures.append(faults.call_async(srv.InjectFault.Request(name="x")))
        time.sleep(0.005 if sent < 300 else 0.001)
    # It may answer the first of them after the last request was sent.
    until(flooded, "refusals")
    refused = refusals()
    client.state()
    node.stop()
    assert node.exit_code == 0
    bags = sorted(tmp_path.glob("bag*"))
    assert len(bags) <= 1 + sent - refused.count(standard_srv.ResetSimulation.Response), (
        "a refused reset made a recording"
    )
    assert recover(bags[-1]).healthy


class Watcher:
    """Takes what is said of the run."""

    def __init__(self) -> None:
        self.seen: list[tuple[int, str, str]] = []
        """Tick, state and reason."""

    def wants(self, topic: str) -> bool:
        return topic == "run_state"

    def write(self, topic: str, data: bytes, stamp_ns: int) -> None:
        message = typestore().deserialize_cdr(data, TOPICS[topic].type)
        self.seen.append((int(message.tick), message.text, message.reason))


def test_what_the_run_is_doing_is_said_whenever_that_changes() -> None:
    """Lockstep is a separate state, so that a line that waits for its controller does not look paused."""
    scene, watcher = load_scene(Path(__file__).with_name("small_line.yaml"), {"duration": 0.05}), Watcher()
    run = ActiveRun(
        lambda runs, loaded: RunSession(Simulation(scene), watcher, None, "world", default_distro()),
        playing=False,
        lockstep_max_ticks=10,
        log=logging.getLogger(__name__),
    )
    stepper = Stepper(run, real_time_factor=0.0, beat=lambda stamp_ns, now: None, died=lambda error: None)

    def ask(target: int, release: bool = False) -> None:
        request = LockstepRequest("plc", target, SentInputs(), release)
        stepper.call(lambda: stepper.advance_lockstep(request)).result(60.0).result(60.0)

    def end() -> None:
        stepper.call(stepper.play).result(60.0)
        deadline = time.monotonic() + 60.0
        while watcher.seen[-1][1] != "ended" and time.monotonic() < deadline:
            time.sleep(0.01)

    stepper.start()
    ask(2)
    ask(3)
    ask(4, release=True)
    end()
    stepper.call(stepper.stop).result(60.0)
    stepper.call(stepper.pause).result(60.0)
    stepper.call(lambda: None).result(60.0)
    stepper.shutdown()
    assert watcher.seen == [
        (0, "paused", ""),
        (0, "lockstep", "plc"),
        (3, "paused", ""),  # it releases the run with its last request
        (4, "running", ""),
        (5, "ended", ""),
        (0, "stopped", "reset and stopped on request"),
        (0, "paused", ""),
        (0, "stopped", "the simulation is shutting down"),
    ]


def test_a_run_that_cant_go_on_says_why() -> None:
    scene, watcher = load_scene(Path(__file__).with_name("small_line.yaml")), Watcher()

    class Broken(RunSession):
        def tick(self) -> list[CommandOutcome]:
            raise SimulationError("it broke")

    run = ActiveRun(
        lambda runs, loaded: Broken(Simulation(scene), watcher, None, "world", default_distro()),
        playing=True,
        lockstep_max_ticks=10,
        log=logging.getLogger(__name__),
    )
    stepper = Stepper(run, real_time_factor=0.0, beat=lambda stamp_ns, now: None, died=lambda error: None)
    stepper.start()
    deadline = time.monotonic() + 60.0
    while len(watcher.seen) < 2 and time.monotonic() < deadline:
        time.sleep(0.01)
    stepper.shutdown()
    assert watcher.seen == [(0, "running", ""), (0, "stopped", "it broke")]
