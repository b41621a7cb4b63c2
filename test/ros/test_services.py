"""The services with simulation_interfaces' names, over DDS."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from conveyor_msgs import srv
from conveyor_msgs.msg import CommandOutcome, Line, Result, SimulationState
from facts import missing
from ros.line_client import LineClient, until
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from conveyor_sim.ros.child import Child

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
    client.call(srv.SetSimulationState, "set_simulation_state", state=SimulationState(state=PAUSED))


def set_state(line: LineClient, state: int) -> Result:
    return line.call(srv.SetSimulationState, "set_simulation_state", state=SimulationState(state=state)).result


def step(line: LineClient, ticks: int) -> Result:
    return line.call(srv.StepSimulation, "step_simulation", steps=ticks).result


def reset(line: LineClient, scope: int = 0) -> Result:
    return line.call(srv.ResetSimulation, "reset_simulation", scope=scope).result


def tick(line: LineClient) -> int:
    """The present tick: a refused lockstep request tells it."""
    return int(line.lockstep(0).tick)


def test_it_starts_paused_when_asked_to(line: LineClient) -> None:
    assert line.state() == PAUSED
    assert tick(line) == 0


def test_features_tell_what_is_served(line: LineClient) -> None:
    response = line.call(srv.GetSimulatorFeatures, "get_simulator_features")
    reset_all, get, put, pause, single, multiple = 20, 24, 25, 26, 31, 32
    assert set(response.features) == {reset_all, get, put, pause, single, multiple}
    assert "conveyor_sim" in response.custom_info


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
    for scope in (srv.ResetSimulation.Request.SCOPE_TIME, srv.ResetSimulation.Request.SCOPE_STATE):
        result = reset(line, scope)
        assert result.result == Result.RESULT_FEATURE_UNSUPPORTED
        assert f"scope: {scope} given" in result.error_message
    assert tick(line) == 3
    assert reset(line, srv.ResetSimulation.Request.SCOPE_ALL).result == Result.RESULT_OK


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


def test_the_real_types_are_served_beside_where_they_are_installed(line: LineClient) -> None:
    real = pytest.importorskip("simulation_interfaces.srv")
    features = line.call(real.GetSimulatorFeatures, "simulation_interfaces/get_simulator_features").features
    assert 32 in features.features
    stepped = line.call(real.StepSimulation, "simulation_interfaces/step_simulation", steps=4)
    assert stepped.result.result == Result.RESULT_OK
    assert tick(line) == 4
    state = line.call(real.GetSimulationState, "simulation_interfaces/get_simulation_state").state
    assert state.state == PAUSED
    assert line.call(real.ResetSimulation, "simulation_interfaces/reset_simulation").result.result == Result.RESULT_OK
    assert tick(line) == 0
