"""Parameters declared from a table: name, default, description and limits, checked at the start and when set."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from conveyor_sim.errors import ConveyorError
from conveyor_sim.support.printable import printable

_KINDS = {bool: "true or false", int: "a whole number", float: "a number", str: "a text"}


@dataclass(frozen=True)
class DeclaredParameter:
    """One parameter. A number must lie in [low, high]. Only a parameter that is not `fixed` may change later."""

    name: str
    default: bool | int | float | str
    description: str
    low: float = 0.0
    high: float = 0.0
    fixed: bool = True

    def refusal(self, value: object) -> str:
        """Return why `value` is invalid for this parameter, empty if it is valid."""
        kind = type(self.default)
        if kind is float and type(value) is int:  # `-p real_time_factor:=2` means 2.0
            value = float(value)
        if type(value) is not kind:
            return f"{self.name}: {printable(repr(value))} given, expected {_KINDS[kind]}"
        if isinstance(value, (int, float)) and kind is not bool and not self.low <= value <= self.high:
            return f"{self.name}: {value} given, expected {_KINDS[kind]} from {self.low:g} to {self.high:g}"
        return ""

    def descriptor(self) -> ParameterDescriptor:
        """Return the descriptor for `ros2 param describe`. Types are checked by refusal() for its error message."""
        descriptor = ParameterDescriptor(description=self.description, read_only=self.fixed, dynamic_typing=True)
        if type(self.default) is float:
            descriptor.floating_point_range = [FloatingPointRange(from_value=self.low, to_value=self.high)]
        elif type(self.default) is int:
            descriptor.integer_range = [IntegerRange(from_value=int(self.low), to_value=int(self.high))]
        return descriptor


def declare_table(node: Node, table: Sequence[DeclaredParameter]) -> dict[str, Any]:
    """Declare parameters on `node`, with checks. Return their values by name. Raise ConveyorError if one is invalid."""
    values = {}
    for entry in table:
        # Checked before rclpy knows the limits, so that our error states the expected values.
        value = node.declare_parameter(entry.name, entry.default, ParameterDescriptor(dynamic_typing=True)).value
        if reason := entry.refusal(value):
            raise ConveyorError(f"parameter {reason}")
        values[entry.name] = type(entry.default)(value)
        if type(value) is not type(entry.default):
            node.set_parameters([Parameter(entry.name, value=values[entry.name])])
        node.set_descriptor(entry.name, entry.descriptor())

    entries = {entry.name: entry for entry in table}

    def convert(parameters: list[Parameter]) -> list[Parameter]:
        """Convert integers to floats for parameters that are numbers."""
        return [
            Parameter(parameter.name, value=float(parameter.value))
            if type(parameter.value) is int
            and parameter.name in entries
            and type(entries[parameter.name].default) is float
            else parameter
            for parameter in parameters
        ]

    def check(parameters: list[Parameter]) -> SetParametersResult:
        known = [(entries[parameter.name], parameter.value) for parameter in parameters if parameter.name in entries]
        reasons = [reason for entry, value in known if (reason := entry.refusal(value))]
        return SetParametersResult(successful=not reasons, reason="; ".join(reasons))

    node.add_pre_set_parameters_callback(convert)
    node.add_on_set_parameters_callback(check)
    return values
