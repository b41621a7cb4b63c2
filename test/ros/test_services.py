# SPDX-License-Identifier: Apache-2.0
"""The services with simulation_interfaces' names, over DDS."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from conveyor_msgs.msg import CommandOutcome, Line
from facts import missing
from ros.line_client import LineClient, until
from simulation_interfaces import srv as standard_srv
from simulation_interfaces.msg import Result, SimulationState, SimulatorFeatures
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from conveyor_sim.ros.child import Child
from conveyor_sim.ros.services import FEATURES

STOPPED, PLAYING, PAUSED = range(3)
LAST = 400  # tick of the small line's end
ALREADY_IN_TARGET_STATE = 101


@pytest.fixture(scope="module")
def shared_node(start_node: Callable[..., Child]) -> Child:
    return start_node()


@pytest.fixture
def line(shared_node: Child, client: LineClient) -> Iterator[LineClient]:
    client.call(Trigger, "pause")
    client.reset()
    yield client
    client.call(standard_srv.SetSimulationState, "set_simulation_state", state=SimulationState(state=PAUSED))


def set_state(line: LineClient, state: int) -> Result:
    return line.call(standard_srv.SetSimulationState, "set_simulation_state", state=SimulationState(state=state)).result


def step(line: LineClient, ticks: int) -> Result:
    return line.call(standard_srv.StepSimulation, "step_simulation", steps=ticks).result


def reset(line: LineClient, scope: int = 0) -> Result:
    return line.call(standard_srv.ResetSimulation, "reset_simulation", scope=scope).result


def tick(line: LineClient) -> int:
    """The present tick: a refused lockstep request tells it."""
    return int(line.lockstep(0).tick)


def test_it_starts_paused_when_asked_to(line: LineClient) -> None:
    assert line.state() == PAUSED
    assert tick(line) == 0


def test_every_feature_that_is_stated_is_served_and_no_other(line: LineClient) -> None:
    features = line.call(standard_srv.GetSimulatorFeatures, "get_simulator_features").features
    stated = {name for name in FEATURES if getattr(SimulatorFeatures, name) in features.features}
    assert len(stated) == len(features.features) == len(FEATURES)  # the version of this distribution has all of them
    interfaces = {
        "SPAWNING": "spawn_entity",
        "DELETING": "delete_entity",
        "NAMED_POSES": "get_named_poses",
        "POSE_BOUNDS": "get_named_pose_bounds",
        "ENTITY_BOUNDS": "get_entity_bounds",
        "ENTITY_STATE_GETTING": "get_entity_state",
        "ENTITY_STATE_SETTING": "set_entity_state",
        "ENTITY_INFO_GETTING": "get_entity_info",
        "ENTITY_INFO_SETTING": "set_entity_info",
        "SPAWNABLES": "get_spawnables",
        "SPAWNING_ENTITIES": "spawn_entities",
        "SIMULATION_RESET": "reset_simulation",
        "SIMULATION_STATE_GETTING": "get_simulation_state",
        "SIMULATION_STATE_SETTING": "set_simulation_state",
        "STEP_SIMULATION_SINGLE": "step_simulation",
        "STEP_SIMULATION_ACTION": "simulate_steps/_action/send_goal",
        "WORLD_LOADING": "load_world",
        "WORLD_UNLOADING": "unload_world",
        "WORLD_INFO_GETTING": "get_current_world",
        "AVAILABLE_WORLDS": "get_available_worlds",
    }
    offered = {name for name, _ in line.node.get_service_names_and_types_by_node("conveyor_sim", "/")}
    for prefix in ("/", "/conveyor_sim/"):
        served = {feature for feature, name in interfaces.items() if prefix + name in offered}
        assert served == stated & interfaces.keys()
    assert "conveyor_sim" in features.custom_info


def test_a_step_advances_by_so_many_ticks_and_answers_when_done(line: LineClient) -> None:
    for ticks, then in ((1, 1), (41, 42)):
        assert step(line, ticks).result == Result.RESULT_OK
        assert tick(line) == then
    assert line.state() == PAUSED


@pytest.mark.parametrize(
    ("ticks", "reason"), [(0, "0 given"), (LAST + 1, f"{LAST + 1} given, but the run ends in {LAST} ticks")]
)
def test_a_step_that_cannot_be_is_refused(line: LineClient, ticks: int, reason: str) -> None:
    result = step(line, ticks)
    assert result.result == Result.RESULT_OPERATION_FAILED
    assert reason in result.error_message
    assert tick(line) == 0


def test_resume_lets_time_pass_and_pause_stops_it(line: LineClient) -> None:
    assert line.call(Trigger, "resume").success
    until(lambda: tick(line) > 0, "the first tick")
    assert line.call(Trigger, "pause").success
    assert line.state() == PAUSED
    stands = tick(line)
    assert tick(line) == stands


def test_a_step_is_refused_unless_paused(line: LineClient) -> None:
    assert set_state(line, STOPPED).result == Result.RESULT_OK
    result = step(line, 1)
    assert result.result == Result.RESULT_OPERATION_FAILED
    assert missing(result.error_message, ["STOPPED", "expected PAUSED"]) == []


def test_states_are_set_as_asked(line: LineClient) -> None:
    line.step(5)
    assert set_state(line, PAUSED).result == ALREADY_IN_TARGET_STATE
    assert set_state(line, STOPPED).result == Result.RESULT_OK
    assert (line.state(), tick(line)) == (STOPPED, 0)
    assert set_state(line, STOPPED).result == ALREADY_IN_TARGET_STATE
    assert set_state(line, PAUSED).result == Result.RESULT_OK
    assert (line.state(), tick(line)) == (PAUSED, 0)
    assert set_state(line, PLAYING).result == Result.RESULT_OK
    until(lambda: tick(line) > 0, "the first tick")


def test_an_unknown_state_is_refused(line: LineClient) -> None:
    result = set_state(line, 9)
    assert result.result == Result.RESULT_FEATURE_UNSUPPORTED
    assert "state: 9 given" in result.error_message


def test_a_reset_goes_back_to_tick_0_in_a_new_run(line: LineClient) -> None:
    with line.listen(Line, "line") as lines:
        lines.first()
        line.step(7)
        lines.messages.clear()
        assert reset(line).result == Result.RESULT_OK
        first = lines.first()
        lines.messages.clear()
        line.reset()
        assert lines.first().run_id != first.run_id
    assert tick(line) == 0
    assert line.state() == PAUSED


def test_a_reset_of_time_alone_is_not_supported(line: LineClient) -> None:
    line.step(3)
    for scope in (standard_srv.ResetSimulation.Request.SCOPE_TIME, standard_srv.ResetSimulation.Request.SCOPE_STATE):
        result = reset(line, scope)
        assert result.result == Result.RESULT_FEATURE_UNSUPPORTED
        assert f"scope: {scope} given" in result.error_message
    assert tick(line) == 3
    assert reset(line, standard_srv.ResetSimulation.Request.SCOPE_ALL).result == Result.RESULT_OK


def test_at_the_end_it_pauses_until_a_reset(line: LineClient, shared_node: Child) -> None:
    set_state(line, PLAYING)
    until(lambda: line.state() == PAUSED, "the end of the run")
    assert tick(line) == LAST
    for result in (step(line, 1), set_state(line, PLAYING)):
        assert missing(result.error_message, ["ended", f"tick {LAST}"]) == []
    assert not line.call(Trigger, "resume").success
    outcomes = line.listen(CommandOutcome, "outcomes")
    speed = line.publisher(Float64, "belts/feeder/cmd_speed", "cmd_speed")
    speed.publish(Float64(data=0.25))
    until(
        lambda: "cmd_speed refused since the run has ended" in shared_node.log.read_text(), "the refusal of a command"
    )
    until(lambda: len(outcomes.messages) == 1, "its outcome")
    told = outcomes.messages[0]
    assert (told.tick, told.accepted) == (LAST, False)
    assert missing(told.reason, ["ended", f"tick {LAST}", "reset"]) == []
    line.reset()
    line.step(1)
    assert tick(line) == 1
