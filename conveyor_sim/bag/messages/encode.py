# SPDX-License-Identifier: Apache-2.0
"""Serialization of columns as messages: CDR bytes that are published and recorded alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.bag.messages.cdr import CdrWriter, packer, pose_rows
from conveyor_sim.columns.alarms import AlarmColumns
from conveyor_sim.columns.bottles import BottleColumns
from conveyor_sim.columns.image import Image
from conveyor_sim.line.commands.inputs import CommandOutcome, Input
from conveyor_sim.line.run_state import RunState
from conveyor_sim.line.tag import Tag
from conveyor_sim.scene.recorded import recorded_source

if TYPE_CHECKING:
    from conveyor_sim.simulation import Simulation

FORMAT = 8
"""Version of the messages and of the meaning of the recorded scene text (Line.format). It is raised by one at each
change that a reader must know; `older.py` reads the earlier ones.
"""

COUNTERS = "conveyor_msgs/msg/Counters"
SIGNALS = "conveyor_msgs/msg/Signals"
COMMANDS = "conveyor_msgs/msg/Commands"
LINE = "conveyor_msgs/msg/Line"
OUTCOME = "conveyor_msgs/msg/CommandOutcome"
ALARM_STATES = "conveyor_msgs/msg/AlarmStates"
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
    """Return the process image of a Signals message."""
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
    bottles: tuple[int, ...]

    @staticmethod
    def of(result: CommandOutcome) -> Outcome:
        """Return the recorded form of a command result."""
        source, writer, kind, operation, names, values, texts = result.input
        return Outcome(
            source, names, values, result.accepted, result.reason, writer, kind, operation, texts, result.bottles
        )

    @property
    def input(self) -> Input:
        """The input."""
        return Input(self.source, self.writer, self.writer_kind, self.operation, self.names, self.values, self.texts)


def outcome_message(outcome: CommandOutcome, header: Header) -> bytes:
    """Return a conveyor_msgs/CommandOutcome."""
    values = {
        **outcome.input._asdict(),
        "accepted": outcome.accepted,
        "reason": outcome.reason,
        "bottles": outcome.bottles,
    }
    return _pack(OUTCOME, header, values)


def to_outcome(message: Any) -> Outcome:
    """Return the outcome of a CommandOutcome message."""
    return Outcome(
        source=message.source,
        names=tuple(message.names),
        values=tuple(float(value) for value in message.values),
        accepted=bool(message.accepted),
        reason=message.reason,
        writer=message.writer,
        writer_kind=message.writer_kind,
        operation=message.operation,
        texts=tuple(message.texts),
        bottles=tuple(int(bottle) for bottle in message.bottles),
    )


class AlarmIds(NamedTuple):
    """Fields of conveyor_msgs/AlarmIds."""

    ids: Sequence[str]


def alarms_message(columns: AlarmColumns, header: Header) -> bytes:
    """Return a conveyor_msgs/AlarmStates."""
    return _pack(ALARM_STATES, header, {**vars(columns), "suppressed_by": [*map(AlarmIds, columns.suppressed_by)]})


def to_alarms(message: Any) -> AlarmColumns:
    """Return the columns of an AlarmStates message."""
    columns = {field.name: getattr(message, field.name) for field in fields(AlarmColumns)}
    return AlarmColumns(**{**columns, "suppressed_by": [tuple(causes.ids) for causes in message.suppressed_by]})


def commands_message(names: Sequence[str], values: NDArray[np.float64], header: Header) -> bytes:
    """Return a conveyor_msgs/Commands with setpoints only."""
    return _pack(COMMANDS, header, {"names": names, "values": values, "alarms": (), "spawned": (), "deleted": ()})


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


class TagFields(NamedTuple):
    """Fields of conveyor_msgs/Tag."""

    name: str
    kind: str
    role: str
    unit: str
    unit_code: str
    min: float
    max: float
    initial: float
    nominal: float
    state_values: Sequence[int]
    state_texts: Sequence[str]
    description: str
    device: str
    device_class: str

    @staticmethod
    def of(tag: Tag) -> TagFields:
        """Return the fields of a tag."""
        return TagFields(
            name=tag.name,
            kind=tag.kind,
            role=tag.role,
            unit=tag.unit,
            unit_code=tag.unece.code,
            min=tag.low,
            max=tag.high,
            initial=tag.initial,
            nominal=tag.nominal or 0.0,
            state_values=tuple(tag.texts),
            state_texts=tuple(tag.texts.values()),
            description=tag.description,
            device=tag.device,
            device_class=tag.device_class,
        )


def line_message(sim: Simulation, run_id: str, header: Header) -> bytes:
    """Return a conveyor_msgs/Line: the meaning of indices, and all data needed to run the same line again."""
    scene, model, image = sim.scene, sim.model, sim.process_image
    text, overrides = recorded_source(scene)
    values = {
        "format": FORMAT,
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
        "command_names": list(image.command_names),
        "fault_names": list(image.fault_names),
        "versions": list(model.versions),
        "engine_hash": model.engine_hash,
        "machine": model.machine,
        "where": scene.where,
        "start_time": scene.start_time,
        "tags": [TagFields.of(tag) for tag in image.tags],
        "sweeps": model.sweeps,
    }
    return _pack(LINE, header, values)
