# SPDX-License-Identifier: Apache-2.0
"""Parameters of nodes, declared from a table and checked at the start and when set; those of `conveyor_sim`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from conveyor_sim.errors import ConveyorError
from conveyor_sim.scene.choices import choices, settings_of
from conveyor_sim.support.printable import printable

_KINDS = {bool: "true or false", int: "a whole number", float: "a number", str: "a text"}


@dataclass(frozen=True)
class DeclaredParameter:
    """One parameter. A number must lie in [low, high], a text be one of `choices`, if there are any.

    Only a parameter that is not `fixed` may change later.
    """

    name: str
    default: bool | int | float | str
    description: str
    low: float = 0.0
    high: float = 0.0
    fixed: bool = True
    choices: tuple[str, ...] = ()

    def refusal(self, value: object) -> str:
        """Return why `value` is invalid for this parameter, empty if it is valid."""
        kind = type(self.default)
        if kind is float and type(value) is int:  # `-p real_time_factor:=2` means 2.0
            value = float(value)
        if type(value) is not kind:
            return f"{self.name}: {printable(repr(value))} given, expected {_KINDS[kind]}"
        if isinstance(value, (int, float)) and kind is not bool and not self.low <= value <= self.high:
            return f"{self.name}: {value} given, expected {_KINDS[kind]} from {self.low:g} to {self.high:g}"
        if self.choices and value not in self.choices:
            return f"{self.name}: {printable(repr(value))} given, expected {' or '.join(self.choices)}"
        return ""

    def descriptor(self) -> ParameterDescriptor:
        """Return the descriptor for `ros2 param describe`. Types are checked by refusal() for its error message."""
        descriptor = ParameterDescriptor(description=self.description, read_only=self.fixed, dynamic_typing=True)
        if type(self.default) is float:
            descriptor.floating_point_range = [FloatingPointRange(from_value=self.low, to_value=self.high)]
        elif type(self.default) is int:
            descriptor.integer_range = [IntegerRange(from_value=int(self.low), to_value=int(self.high))]
        return descriptor


def declare_one(node: Node, entry: DeclaredParameter) -> Any:
    """Declare a parameter on `node`. Return its value. Raise ConveyorError if it is invalid."""
    # Checked before rclpy knows the limits, so that our error states the expected values.
    value = node.declare_parameter(entry.name, entry.default, ParameterDescriptor(dynamic_typing=True)).value
    if reason := entry.refusal(value):
        raise ConveyorError(f"parameter {reason}")
    if type(value) is not type(entry.default):
        value = type(entry.default)(value)
        node.set_parameters([Parameter(entry.name, value=value)])
    node.set_descriptor(entry.name, entry.descriptor())
    return value


def declare_table(node: Node, table: Sequence[DeclaredParameter]) -> dict[str, Any]:
    """Declare parameters on `node`, with checks. Return their values by name. Raise ConveyorError if one is invalid."""
    values = {entry.name: declare_one(node, entry) for entry in table}
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


_RATE_TEXT = "Hz of simulated time; -1: that of the scene, 0: never. Must divide the tick rate."
RATES = ("bottles", "poses", "contacts", "belts", "signals", "ledger", "damage", "counters")

TABLE = (
    DeclaredParameter("scene", "paper_plant", "Scene file, or the name of a shipped scene."),
    DeclaredParameter("duration", 0.0, "s of simulated time at which the run ends; 0: that of the scene.", 0.0, 1e9),
    DeclaredParameter(
        "start_paused", False, "Wait at tick 0 for resume, step_simulation, set_simulation_state, lockstep."
    ),
    DeclaredParameter(
        "real_time_factor",
        1.0,
        "Simulated seconds per wall second; 0: as fast as possible, for recording and lockstep, not for free "
        "controllers.",
        0.0,
        1e6,
        fixed=False,
    ),
    DeclaredParameter("outside_tables", False, "Whether the scene may refer to files outside its folder."),
    DeclaredParameter("set", "", "Parameters of the scene: NAME=VALUE, several with semicolons between them."),
    DeclaredParameter("variant", "", "Variant of the scene; empty text: the one that its file names, if any."),
    DeclaredParameter("format", "", "Format of the scene; empty text: the one that its file names, if any."),
    DeclaredParameter(
        "checkpoint_folder",
        "checkpoints",
        "Folder of save_checkpoint and load_checkpoint, made when first needed; empty text: both refuse.",
    ),
    DeclaredParameter("record", "", "Folder of the rosbag2 recording, new or empty; empty text: do not record."),
    DeclaredParameter("frame_id", "world", "Frame of all positions, in every header."),
    DeclaredParameter("publish_clock", True, "Whether /clock is published."),
    DeclaredParameter("clock_rate", 100.0, "Largest number of /clock messages per wall second.", 1.0, 1e4),
    DeclaredParameter("marker_rate", 30.0, "Largest number of markers per wall second; recordings have all.", 1.0, 1e4),
    DeclaredParameter("threads", 0, "Number of threads that step; 0: the fastest number.", 0, 1024),
    DeclaredParameter("lockstep_max_ticks", 100_000, "Longest advance of one lockstep request, in ticks.", 1, 10**9),
    *(DeclaredParameter(f"rates.{name}", -1.0, f"Rate of {name}: {_RATE_TEXT}", -1.0, 1e6) for name in RATES),
)


@dataclass(frozen=True)
class Parameters:
    """Values at the start."""

    scene: str
    duration: float
    start_paused: bool
    real_time_factor: float
    outside_tables: bool
    set: str
    variant: str
    format: str
    checkpoint_folder: Path | None
    record: Path | None
    frame_id: str
    publish_clock: bool
    clock_rate: float
    marker_rate: float
    threads: int
    lockstep_max_ticks: int
    rates: Mapping[str, float]

    def overrides(self) -> dict[str, Any]:
        """Return the overrides of the scene file, which the recording stores for a replay. Raise SceneError."""
        settings = settings_of(text for text in self.set.split(";") if text.strip())
        changed = choices(settings, self.variant or None, self.format or None)
        if self.duration > 0.0:
            changed["duration"] = self.duration
        rates = {name: rate for name, rate in self.rates.items() if rate >= 0.0}
        if rates:
            changed["outputs"] = rates
        return changed


def declare(node: Node) -> Parameters:
    """Declare all parameters of TABLE on `node`. Raise ConveyorError for an invalid value."""
    values = declare_table(node, TABLE)
    rates = {name: values.pop(f"rates.{name}") for name in RATES}
    record, checkpoints = values.pop("record"), values.pop("checkpoint_folder")
    return Parameters(
        **values,
        record=_folder(record) if record else None,
        checkpoint_folder=_folder(checkpoints).absolute() if checkpoints else None,
        rates=rates,
    )


def _folder(text: str) -> Path:
    try:
        return Path(text).expanduser()
    except RuntimeError:
        raise ConveyorError(f"parameter: {text!r} given, expected the home of an existing user") from None
