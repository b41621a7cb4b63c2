# SPDX-License-Identifier: Apache-2.0
"""Lockstep over DDS."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest
import rclpy
from conveyor_msgs import srv
from facts import missing
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from ros.conftest import SMALL_LINE
from ros.line_client import LineClient, until
from simulation_interfaces import srv as standard_srv
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from conveyor_sim.bag.messages.qos import ANSWERS
from conveyor_sim.ros.child import Child
from conveyor_sim.ros.publishers import ros_qos
from conveyor_sim.ros.spinner import Spinner
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

FEEDER = "belts/feeder/cmd_speed"
KILLED_CLIENT = """
import ast, sys, time
import rclpy
from conveyor_msgs.srv import Lockstep
rclpy.init()
node = rclpy.create_node("killed")
client = node.create_client(Lockstep, "conveyor_sim/lockstep")
client.wait_for_service()
client.call_async(Lockstep.Request(**ast.literal_eval(sys.argv[1])))
time.sleep(60)
"""


def test_a_scan_advances_and_answers_with_the_state_of_the_engine(line: LineClient) -> None:
    engine = Simulation(load_scene(SMALL_LINE))
    for target, speed in ((10, 0.25), (30, 0.75), (31, 0.0)):
        response = line.lockstep(target, names=[FEEDER], values=[speed])
        engine.command([FEEDER], [speed])
        engine.advance(target - engine.tick)
        assert response.accepted
        assert (response.tick, response.signals.tick) == (target, target)
        assert response.time.sec * 10**9 + response.time.nanosec == engine.stamp_ns
        assert np.array_equal(response.signals.values, engine.signals())
        assert response.state_hash == engine.state_hash()


def test_a_repeated_request_gets_the_stored_answer_and_advances_nothing(line: LineClient) -> None:
    first = line.lockstep(10, names=[FEEDER], values=[0.25])
    again = line.lockstep(10, names=[FEEDER], values=[0.25])
    assert again == first
    assert line.lockstep(0).tick == 10


def test_a_request_sent_twice_at_once_is_carried_out_once(line: LineClient) -> None:
    request = srv.Lockstep.Request(run_id="test", target_tick=200, names=[FEEDER], values=[0.25])
    client = line.client(srv.Lockstep, "lockstep")
    futures = [client.call_async(request) for _ in range(3)]
    answers = [until(future.result, "an answer") for future in futures]
    assert answers[0].accepted
    assert len(answers[0].outcomes) == 1
    assert answers[1] == answers[0]
    assert answers[2] == answers[0]


def test_a_client_that_sleeps_while_another_scans_still_gets_its_answer(line: LineClient) -> None:
    """Every client is sent the answers to all: 200 of them must not push out the one it waits for."""
    context = rclpy.Context()
    rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    sleeper = Node("sleeper", context=context)
    client = sleeper.create_client(srv.Lockstep, "conveyor_sim/lockstep", qos_profile=ros_qos(ANSWERS))
    until(client.service_is_ready, "the service lockstep")
    answer = client.call_async(srv.Lockstep.Request(run_id="sleeper"))
    for target in range(1, 201):
        line.lockstep(target)
    spinner = Spinner(context)
    spinner.start(sleeper)
    reason = until(answer.result, "the answer").reason  # whichever of the two participants was heard first
    assert reason.startswith(("stale: target_tick 0", "the simulation is owned by run 'test'"))
    spinner.close()
    sleeper.destroy_node()
    rclpy.shutdown(context=context)


def test_what_a_reset_breaks_off_is_answered_with_the_new_run(line: LineClient) -> None:
    """Or its controller would take the refusal for one of the run that it is in."""
    client = line.client(srv.Lockstep, "lockstep")
    for _ in range(10):
        answer = client.call_async(srv.Lockstep.Request(run_id="plc", target_tick=90_000))
        until(lambda: line.lockstep(0).tick > 0, "the advance to begin")
        line.reset()
        response = until(answer.result, "the answer")
        assert (response.accepted, response.reason) == (False, "the simulation was reset")
        assert response.sim_run_id == line.lockstep(0).sim_run_id


def test_what_a_client_asked_that_was_killed_is_carried_out_and_its_successor_gets_the_answer(
    line: LineClient,
) -> None:
    asked = {"run_id": "plc", "target_tick": 20_000, "names": [FEEDER], "values": [0.25]}
    with subprocess.Popen([sys.executable, "-c", KILLED_CLIENT, repr(asked)]) as process:
        try:
            until(lambda: line.lockstep(0).tick > 0, "the advance to begin")
        finally:
            process.kill()
    successor = line.client(srv.Lockstep, "lockstep").call_async(srv.Lockstep.Request(**asked))
    response = until(successor.result, "the answer")
    assert (response.accepted, response.tick) == (True, 20_000)
    assert [outcome.source for outcome in response.outcomes] == ["lockstep"]
    assert line.lockstep(20_001, run_id="plc").accepted


def test_a_stale_request_is_refused_and_tells_the_present_tick_and_signals(line: LineClient) -> None:
    at_ten = line.lockstep(10)
    response = line.lockstep(9)
    assert not response.accepted
    assert (response.signals, response.state_hash) == (at_ten.signals, at_ten.state_hash)
    assert "stale: target_tick 9 given, expected more than the present tick 10" in response.reason
    assert response.tick == 10


def test_the_same_tick_with_other_commands_is_refused(line: LineClient) -> None:
    line.lockstep(10, names=[FEEDER], values=[0.25])
    response = line.lockstep(10, names=[FEEDER], values=[0.5])
    assert not response.accepted
    assert "stale" in response.reason


def test_a_second_owner_is_refused_until_the_release(line: LineClient) -> None:
    line.lockstep(10, run_id="first")
    response = line.lockstep(20, run_id="second")
    assert not response.accepted
    assert "owned by run 'first'" in response.reason
    assert line.lockstep(20, run_id="first", release=True).accepted
    assert line.lockstep(30, run_id="second").accepted


def test_an_owner_excludes_steps_and_running_free(line: LineClient) -> None:
    line.lockstep(10, run_id="plc")
    result = line.call(standard_srv.StepSimulation, "step_simulation", steps=1).result
    assert "run 'plc' owns the simulation" in result.error_message
    resumed = line.call(Trigger, "resume")
    assert not resumed.success
    assert "run 'plc' owns the simulation" in resumed.message
    assert line.lockstep(0, run_id="plc").tick == 10


def test_a_reset_clears_the_owner(line: LineClient) -> None:
    line.lockstep(10, run_id="first")
    line.reset()
    response = line.lockstep(10, run_id="second")
    assert response.accepted
    assert response.tick == 10


def test_a_request_of_the_run_before_a_reset_is_refused_as_such(line: LineClient) -> None:
    """And one that names the run that is under way now is carried out."""
    first = line.lockstep(10, names=[FEEDER], values=[0.25])
    again = {"names": [FEEDER], "values": [0.25], "sim_run_id": first.sim_run_id}
    line.reset()
    late = line.lockstep(10, **again)
    assert not late.accepted
    assert late.tick == 0
    assert late.sim_run_id not in ("", first.sim_run_id)
    assert missing(late.reason, str(first.sim_run_id), str(late.sim_run_id), "reset", "checkpoint") == []
    assert line.lockstep(10, **(again | {"sim_run_id": late.sim_run_id})).state_hash == first.state_hash


def test_what_no_controller_sends_is_refused_in_short(line: LineClient) -> None:
    long = line.lockstep(10, run_id="x" * 5_000_000)
    assert missing(long.reason, "run_id", "5000000", "200") == []
    large = line.lockstep(10, names=["x" * 300_000], values=[0.0])
    assert missing(large.reason, "commands", "262144 bytes") == []
    assert (long.accepted, large.accepted, large.tick) == (False, False, 0)
    assert line.lockstep(10, run_id="\x1b[2J\n").accepted
    assert missing(line.lockstep(20, run_id="plc").reason, "'\\x1b[2J\\n'", "release", "reset") == []


def test_a_reset_breaks_off_an_advance(line: LineClient) -> None:
    request = srv.Lockstep.Request(run_id="test", target_tick=10**5)
    future = line.client(srv.Lockstep, "lockstep").call_async(request)
    until(lambda: line.lockstep(0).tick > 0, "the first tick")
    line.reset()
    answer = until(future.result, "the answer to the advance")
    assert not answer.accepted
    assert answer.reason == "the simulation was reset"
    assert (answer.sim_run_id, answer.tick) == (line.lockstep(0).sim_run_id, 0)  # so a controller knows to begin anew


def test_a_reset_breaks_off_a_step(line: LineClient) -> None:
    request = standard_srv.StepSimulation.Request(steps=10**5)
    future = line.client(standard_srv.StepSimulation, "step_simulation").call_async(request)
    until(lambda: line.lockstep(0).tick > 0, "the first tick")
    line.reset()
    result = until(future.result, "the answer to the step").result
    assert result.result == result.RESULT_OPERATION_FAILED
    assert result.error_message == "the simulation was reset"
    assert line.lockstep(0).tick == 0


def test_too_long_an_advance_is_refused(line: LineClient) -> None:
    response = line.lockstep(10**5 + 1)
    assert not response.accepted
    assert f"target_tick {10**5 + 1} given, but the run ends at tick {10**5}" in response.reason


def test_a_bad_command_is_refused_in_the_outcomes_and_the_scan_goes_on(line: LineClient) -> None:
    response = line.lockstep(10, names=[FEEDER], values=[math.nan])
    assert response.accepted
    assert response.tick == 10
    (outcome,) = response.outcomes
    assert not outcome.accepted
    assert outcome.source == "lockstep"
    assert "nan given" in outcome.reason
    assert line.lockstep(0).tick == 10


def test_outcomes_of_other_sources_are_told_once(line: LineClient) -> None:
    speed = line.publisher(Float64, "belts/table/cmd_speed", "cmd_speed")
    line.lockstep(1)
    speed.publish(Float64(data=0.125))
    told = []
    target = 1

    def scanned() -> bool:
        nonlocal target
        target += 1
        told.extend(line.lockstep(target).outcomes)
        return bool(told)

    until(scanned, "the outcome of the speed")
    assert [outcome.source for outcome in told] == ["belts/table/cmd_speed"]
    assert told[0].tick == target - 1
    assert not line.lockstep(target + 1).outcomes


@pytest.mark.parametrize("run_id", ["", "free"])
def test_a_request_is_refused_while_running_free_or_without_a_name(
    line: LineClient, shared_node: Child, run_id: str
) -> None:
    if run_id:
        assert line.call(Trigger, "resume").success
    response = line.lockstep(10**5, run_id=run_id)
    assert not response.accepted
    assert ("the simulation is PLAYING, expected PAUSED" if run_id else "run_id is empty") in response.reason


def test_a_node_that_ends_answers_what_it_will_not_carry_out(line: LineClient, shared_node: Child) -> None:
    """The last test of the shared node."""
    answer = line.client(srv.Lockstep, "lockstep").call_async(srv.Lockstep.Request(run_id="plc", target_tick=90_000))
    until(lambda: line.lockstep(0).tick > 0, "the advance to begin")
    shared_node.stop()
    response = until(answer.result, "the answer")
    assert (response.accepted, response.reason) == (False, "the simulation is shutting down")
    assert shared_node.exit_code == 0, shared_node.obituary()
