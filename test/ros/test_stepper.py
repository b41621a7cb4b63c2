"""The stepping thread, and what waits for it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from conveyor_msgs import srv
from ros.line_client import LineClient

from conveyor_sim.bag.recover import recover
from conveyor_sim.ros.calls import MOST_CALLS
from conveyor_sim.ros.child import Child
from conveyor_sim.ros.lockstep import Refused
from conveyor_sim.ros.stepper import Stepper


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
        client.client(srv.ResetSimulation, "reset_simulation"),
        client.client(srv.InjectFault, "inject_fault"),
    )
    futures = []
    for number in range(300):
        futures.append(resets.call_async(srv.ResetSimulation.Request()))
        if number % 5 == 4:
            futures.append(faults.call_async(srv.InjectFault.Request(name="x")))
        time.sleep(0.005)
    answers = [future.result() for future in futures if future.done()]
    client.state()
    node.stop()
    assert node.exit_code == 0
    refused = {type(answer).__name__ for answer in answers if "100 requests wait for their answers" in str(answer)}
    assert refused == {"ResetSimulation_Response", "InjectFault_Response"}
    bags = sorted(tmp_path.glob("bag*"))
    assert len(bags) < 100
    assert recover(bags[-1]).healthy
