"""Refuses parameters of types unknown to ROS, for which the callback of rclpy raises and ends the node."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import ParameterType, SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.node import Node

from conveyor_sim.support.printable import printable

LAST = ParameterType.PARAMETER_STRING_ARRAY


def refuse_unknown_types(node: Node) -> None:
    """Check each request to set parameters of a node before rclpy. A refused request sets nothing."""
    for service in node.services:
        if service.srv_type in (SetParameters, SetParametersAtomically):
            service.callback = _checked(service.callback)


def _checked(answer: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    def checked(request: Any, response: Any) -> Any:
        unknown = next((one for one in request.parameters if one.value.type > LAST), None)
        if unknown is None:
            return answer(request, response)
        expected = f"expected 0 to {LAST} (rcl_interfaces/ParameterType)"
        text = f"{printable(unknown.name)}: type {unknown.value.type} given, {expected}"
        refusal = SetParametersResult(successful=False, reason=text)
        if isinstance(response, SetParametersAtomically.Response):
            response.result = refusal
        else:
            response.results = [refusal] * len(request.parameters)
        return response

    return checked
