# SPDX-License-Identifier: Apache-2.0
"""/clock and /diagnostics over DDS, and the real-time factor."""

from __future__ import annotations

from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from ros.line_client import LineClient, until
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger


def nanoseconds(message: Clock) -> int:
    return int(message.clock.sec) * 10**9 + int(message.clock.nanosec)


def set_factor(line: LineClient, value: float) -> Any:
    """The answer of the parameter service."""
    given = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value)
    parameter = Parameter(name="real_time_factor", value=given)
    return line.call(SetParameters, "conveyor_sim/set_parameters", parameters=[parameter]).results[0]


def test_the_clock_is_published_while_paused_and_starts_above_zero(line: LineClient) -> None:
    with line.listen(Clock, "clock") as heard:
        heard.first()
        heard.messages.clear()
        until(lambda: len(heard.messages) >= 3, "the clock of a paused simulation")
    assert {nanoseconds(message) for message in heard.messages} == {1}


def test_the_clock_follows_the_ticks_and_never_goes_back(line: LineClient) -> None:
    with line.listen(Clock, "clock") as heard:
        heard.first()
        line.step(1)
        until(lambda: nanoseconds(heard.messages[-1]) == 10**7, "the clock of tick 1")
        line.call(Trigger, "resume")
        until(lambda: nanoseconds(heard.messages[-1]) > 10**9, "the clock of 1 s")
        line.call(Trigger, "pause")
    times = [nanoseconds(message) for message in heard.messages]
    assert times == sorted(times)
    assert all(time == 1 or time % 10**7 == 0 for time in times)


def test_diagnostics_tell_how_it_fares(line: LineClient) -> None:
    line.step(42)
    status, values = line.diagnostics()
    assert status.level == DiagnosticStatus.OK
    assert status.message == "PAUSED"
    assert status.name == "conveyor_sim: simulation"
    assert values["state"] == "PAUSED"
    assert values["tick"] == "42"
    assert float(values["simulated time (s)"]) == pytest.approx(0.42)
    assert float(values["dt (s)"]) * int(values["steps per tick"]) == pytest.approx(0.01)
    assert values["overruns"] == "0"
    assert int(values["bottles present"]) == 9 + int(values["bottles fed"])


def test_the_real_time_factor_is_kept_to_and_measured(line: LineClient) -> None:
    assert set_factor(line, 0.5).successful
    line.call(Trigger, "resume")
    line.diagnostics()
    _, values = line.diagnostics()
    line.call(Trigger, "pause")
    assert set_factor(line, 0.0).successful
    assert values["real_time_factor"] == "0.5"
    assert 0.0 < float(values["real_time_factor measured"]) < 0.6  # never faster than asked; slower on a busy machine


def test_what_is_too_fast_for_the_machine_is_reported_as_overruns(line: LineClient) -> None:
    assert set_factor(line, 1e6).successful
    line.call(Trigger, "resume")
    status, values = line.diagnostics()
    line.call(Trigger, "pause")
    assert set_factor(line, 0.0).successful
    assert status.level == DiagnosticStatus.WARN
    assert "overruns" in status.message
    assert int(values["overruns"]) > 0


@pytest.mark.parametrize(("value", "reason"), [(-1.0, "out of range"), (float("nan"), "out of range")])
def test_a_real_time_factor_that_cannot_be_is_refused(line: LineClient, value: float, reason: str) -> None:
    result = set_factor(line, value)
    assert not result.successful
    assert reason in result.reason


def test_structural_parameters_are_read_only(line: LineClient) -> None:
    value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value="turntable")
    parameter = Parameter(name="scene", value=value)
    result = line.call(SetParameters, "conveyor_sim/set_parameters", parameters=[parameter]).results[0]
    assert not result.successful
    assert "read-only" in result.reason
