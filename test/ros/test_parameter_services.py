# SPDX-License-Identifier: Apache-2.0
"""Parameters of a running node, set over DDS as `ros2 param set` does."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters, SetParametersAtomically
from ros.line_client import LineClient

from conveyor_sim.ros.child import Child

NAME = "real_time_factor"
WHOLE = ParameterValue(type=ParameterType.PARAMETER_INTEGER, integer_value=3)


def told(line: LineClient) -> Any:
    """The value as it is dumped."""
    return line.call(GetParameters, "conveyor_sim/get_parameters", names=[NAME]).values[0]


def put(line: LineClient, value: ParameterValue) -> Any:
    """The result of setting it."""
    (result,) = line.call(
        SetParameters, "conveyor_sim/set_parameters", parameters=[Parameter(name=NAME, value=value)]
    ).results
    return result


def test_a_whole_number_becomes_the_double_that_is_described(
    start_node: Callable[..., Child], client: LineClient
) -> None:
    """At the start, and whenever it is set."""
    node = start_node(**{NAME: 2})
    (described,) = client.call(DescribeParameters, "conveyor_sim/describe_parameters", names=[NAME]).descriptors
    assert described.type == ParameterType.PARAMETER_DOUBLE
    assert (told(client).type, told(client).double_value) == (ParameterType.PARAMETER_DOUBLE, 2.0)
    assert put(client, WHOLE).successful
    assert (told(client).type, told(client).double_value) == (ParameterType.PARAMETER_DOUBLE, 3.0)
    assert float(client.diagnostics()[1][NAME]) == 3.0
    node.stop()


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        (ParameterValue(type=ParameterType.PARAMETER_STRING, string_value="fast"), "'fast' given, expected a number"),
        (
            ParameterValue(type=ParameterType.PARAMETER_INTEGER, integer_value=-1),
            "out of range Min: 0.0",
        ),
        (ParameterValue(type=ParameterType.PARAMETER_BOOL, bool_value=True), "True given, expected a number"),
        (ParameterValue(), "None given, expected a number"),
    ],
    ids=["text", "negative", "switch", "nothing"],
)
def test_what_is_no_number_is_refused_and_changes_nothing(line: LineClient, value: Any, reason: str) -> None:
    result = put(line, value)
    assert (result.successful, reason in result.reason) == (False, True), result.reason
    assert told(line).double_value == 0.0


@pytest.mark.parametrize("kind", [SetParameters, SetParametersAtomically])
def test_a_type_that_ros_does_not_have_is_refused(line: LineClient, kind: Any) -> None:
    """It ended the node."""
    good = Parameter(name=NAME, value=WHOLE)
    odd = Parameter(name="x", value=ParameterValue(type=77))
    service = "set_parameters" + ("_atomically" if kind is SetParametersAtomically else "")
    response = line.call(kind, f"conveyor_sim/{service}", parameters=[good, odd])
    results = [response.result] if kind is SetParametersAtomically else response.results
    expected = "x: type 77 given, expected 0 to 9 (rcl_interfaces/ParameterType)"
    assert [(result.successful, result.reason) for result in results] == [(False, expected)] * len(results) != []
    assert told(line).double_value == 0.0
