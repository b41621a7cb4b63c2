"""Serialization of columns as messages: CDR bytes that are published and recorded alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.bag.messages.cdr import CdrWriter, packer, pose_rows
from conveyor_sim.columns.bottles import BottleColumns
from conveyor_sim.columns.image import NOTHING_FORCED, Image
from conveyor_sim.line.commands.inputs import CommandOutcome, Input, recorded_input
from conveyor_sim.line.run_state import RunState
from conveyor_sim.scene.recorded import recorded_source

if TYPE_CHECKING:
    from conveyor_sim.simulation import Simulation

SIGNALS = "conveyor_msgs/msg/Signals"
COMMANDS = "conveyor_msgs/msg/Commands"
LINE = "conveyor_msgs/msg/Line"
OUTCOME = "conveyor_msgs/msg/CommandOutcome"
RUN_STATE = "conveyor_msgs/msg/RunState"
BOOL = "std_msgs/msg/Bool"
SPEED = "std_msgs/msg/Float64"
POSES = "geometry_msgs/msg/PoseArray"
MARKERS = "visualization_msgs/msg/MarkerArray"


@dataclass(frozen=True)
class Header:
    """First fields of every message."""

    tick: int
    stamp_ns: int
    """Simulated time, ns, above zero."""
    frame_id: str


def _pack(type_name: str, header: Header, values: dict[str, Any]) -> bytes:
    return packer(type_name).pack(header.frame_id, header.stamp_ns, header.tick, values.__getitem__)


def columns_message(type_name: str, columns: Any, header: Header) -> bytes:
    """Return a message with the fields of a dataclass. If the object has a tick, the header must be of that tick."""
    return packer(type_name).pack(header.frame_id, header.stamp_ns, header.tick, partial(getattr, columns))


def to_image(message: Any) -> Image:
    """Return the process image of a Signals message; in an older message nothing is forced."""
    if not hasattr(message, "forced"):
        return Image(message.values, *NOTHING_FORCED)
    return Image(message.values, message.forced, message.actual)


@dataclass(frozen=True)
class Outcome:
    """One recorded CommandOutcome."""

    source: str
    names: tuple[str, ...]
    values: tuple[float, ...]
    accepted: bool
    reason: str
    writer: str
    writer_kind: str
    operation: str
    texts: tuple[str, ...]

    @staticmethod
    def of(request: Input, accepted: bool, reason: str) -> Outcome:
        """Return the outcome of an input."""
        source, writer, kind, operation, names, values, texts = request
        return Outcome(source, names, values, accepted, reason, writer, kind, operation, texts)

    @property
    def input(self) -> Input:
        """The input."""
        return Input(self.source, self.writer, self.writer_kind, self.operation, self.names, self.values, self.texts)


def outcome_message(outcome: CommandOutcome, header: Header) -> bytes:
    """Return a conveyor_msgs/CommandOutcome."""
    values = {**outcome.input._asdict(), "accepted": outcome.accepted, "reason": outcome.reason}
    return _pack(OUTCOME, header, values)


def to_outcome(message: Any) -> Outcome:
    """Return the outcome of a CommandOutcome message. In an older one, the writer follows from the source."""
    names, values = tuple(message.names), tuple(float(value) for value in message.values)
    if hasattr(message, "operation"):
        request = Input(
            message.source, message.writer, message.writer_kind, message.operation, names, values, tuple(message.texts)
        )
    else:
        request = recorded_input(message.source, names, values)
    return Outcome.of(request, bool(message.accepted), message.reason)


def commands_message(names: Sequence[str], values: NDArray[np.float64], header: Header) -> bytes:
    """Return a conveyor_msgs/Commands, without declarations of alarms."""
    return _pack(COMMANDS, header, {"names": names, "values": values, "alarm_ids": (), "alarms": ()})


def speed_message(speed: float) -> bytes:
    """Return a std_msgs/Float64 with the speed of a belt or drive, m/s."""
    writer = CdrWriter()
    writer.pack("d", speed)
    return writer.finish()


def run_state_message(run: RunState, header: Header) -> bytes:
    """Return a conveyor_msgs/RunState."""
    return _pack(RUN_STATE, header, {"state": run.state, "text": run.text, "reason": run.reason})


def poses_message(columns: BottleColumns, header: Header) -> bytes:
    """Return a geometry_msgs/PoseArray of the bottles' axes, ordered by id, at the height of the belts (z = 0)."""
    writer = CdrWriter()
    writer.header(header.stamp_ns, header.frame_id)
    writer.rows(pose_rows(columns.x, columns.y, columns.theta))
    return writer.finish()


def bool_message(value: bool, header: Header) -> bytes:
    """Return a std_msgs/Bool, which has no header."""
    writer = CdrWriter()
    writer.pack("?", value)
    return writer.finish()


def line_message(sim: Simulation, run_id: str, header: Header) -> bytes:
    """Return a conveyor_msgs/Line: the meaning of indices, and all data needed to run the same line again."""
    scene, model, image = sim.scene, sim.model, sim.process_image
    text, overrides = recorded_source(scene)
    values = {
        "run_id": run_id,
        "scene_name": scene.name,
        "scene_text": text,
        "overrides": overrides,
        "seed": scene.seed,
        "tick_ns": model.tick_ns,
        "steps_per_tick": model.steps_per_tick,
        "dt": model.dt,
        "dt_reason": model.dt_reason,
        "integrator": model.integrator,
        "effects": [effect.name for effect in model.effects if effect.on],
        "belts": list(model.belts),
        "rails": list(model.rails),
        "bottle_types": list(model.bottle_types),
        "type_radius": model.type_radius,
        "type_mass": model.type_mass,
        "signal_names": list(image.signal_names),
        "signal_units": [signal.unit for signal in image.signals],
        "command_names": list(image.command_names),
        "command_units": [command.unit for command in image.commands],
        "command_min": [command.low for command in image.commands],
        "command_max": [command.high for command in image.commands],
        "signal_types": [signal.kind for signal in image.signals],
        "command_types": [command.kind for command in image.commands],
        "fault_names": list(image.fault_names),
        "fault_units": [fault.unit for fault in image.faults],
        "fault_types": [fault.kind for fault in image.faults],
        "fault_min": [fault.low for fault in image.faults],
        "fault_max": [fault.high for fault in image.faults],
        "versions": list(model.versions),
        "engine_hash": model.engine_hash,
        "machine": model.machine,
        "where": scene.where,
        "start_time": scene.start_time,
        "tag_names": [tag.name for tag in image.tags],
        "tag_kinds": [tag.kind for tag in image.tags],
        "tag_roles": [tag.role for tag in image.tags],
        "tag_units": [tag.unit for tag in image.tags],
        "tag_unit_codes": [tag.unece.code for tag in image.tags],
        "tag_min": [tag.low for tag in image.tags],
        "tag_max": [tag.high for tag in image.tags],
        "tag_initial": [tag.initial for tag in image.tags],
        "tag_nominal": [tag.nominal or 0.0 for tag in image.tags],
        "tag_texts": [tag.listed_texts for tag in image.tags],
        "tag_descriptions": [tag.description for tag in image.tags],
        "tag_devices": [tag.device for tag in image.tags],
        "tag_classes": [tag.device_class for tag in image.tags],
    }
    return _pack(LINE, header, values)
