"""Parameters declared from a table: name, default, description and limits, checked at start and whenever set."""

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
class Entry:
    """One parameter. A number must lie in [low, high]; it may change after the start only if it is not `fixed`."""

    name: str
    default: bool | int | float | str
    description: str
    low: float = 0.0
    high: float = 0.0
    fixed: bool = True

    def refusal(self, value: object) -> str:
        """Why `value` can't be this parameter's, empty if it can."""
        kind = type(self.default)
        if kind is float and type(value) is int:  # `-p real_time_factor:=2` means 2.0
            value = float(value)
        if type(value) is not kind:
            return f"{self.name}: {printable(repr(value))} given, expected {_KINDS[kind]}"
        if isinstance(value, (int, float)) and kind is not bool and not self.low <= value <= self.high:
            return f"{self.name}: {value} given, expected {_KINDS[kind]} from {self.low:g} to {self.high:g}"
        return ""

    def descriptor(self) -> ParameterDescriptor:
        """What `ros2 param describe` shows. refusal() judges the type, so that its sentence is shown, not rclpy's."""
        descriptor = ParameterDescriptor(description=self.description, read_only=self.fixed, dynamic_typing=True)
        if type(self.default) is float:
            descriptor.floating_point_range = [FloatingPointRange(from_value=self.low, to_value=self.high)]
        elif type(self.default) is int:
            descriptor.integer_range = [IntegerRange(from_value=int(self.low), to_value=int(self.high))]
        return descriptor


def declare_table(node: Node, table: Sequence[Entry]) -> dict[str, Any]:
    """Declare parameters on `node`, checked from now on; their values by name. Raises ConveyorError if one can't be."""
    values = {}
    for entry in table:
        # Judged before rclpy knows the limits, so that the error is ours and says what was expected.
        value = node.declare_parameter(entry.name, entry.default, ParameterDescriptor(dynamic_typing=True)).value
        if reason := entry.refusal(value):
            raise ConveyorError(f"parameter {reason}")
        values[entry.name] = type(entry.default)(value)
        if type(value) is not type(entry.default):
            node.set_parameters([Parameter(entry.name, value=values[entry.name])])
        node.set_descriptor(entry.name, entry.descriptor())

    entries = {entry.name: entry for entry in table}

    def convert(parameters: list[Parameter]) -> list[Parameter]:
        """A whole number will do where a number is described, and becomes one."""
        return [
            Parameter(given.name, value=float(given.value))
            if type(given.value) is int and given.name in entries and type(entries[given.name].default) is float
            else given
            for given in parameters
        ]

    def check(parameters: list[Parameter]) -> SetParametersResult:
        known = [(entries[parameter.name], parameter.value) for parameter in parameters if parameter.name in entries]
        reasons = [reason for entry, value in known if (reason := entry.refusal(value))]
        return SetParametersResult(successful=not reasons, reason="; ".join(reasons))

    node.add_pre_set_parameters_callback(convert)
    node.add_on_set_parameters_callback(check)
    return values
