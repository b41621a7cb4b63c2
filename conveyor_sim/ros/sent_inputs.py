# SPDX-License-Identifier: Apache-2.0
"""Fields of conveyor_msgs/Commands and Lockstep requests, translated from and to inputs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from conveyor_msgs.msg import Alarm as AlarmMessage

from conveyor_sim.control.alarm import Alarm
from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import SPAWN_VALUES
from conveyor_sim.run.lockstep import SentInputs
from conveyor_sim.support.printable import SENTENCE, printable


def received_inputs(message: Any) -> SentInputs:
    """Return what a Commands message or a Lockstep request holds."""
    return SentInputs(
        alarm_ids=tuple(alarm.id for alarm in message.alarms),
        alarms=tuple(map(_declaration, message.alarms)),
        deleted=tuple(message.deleted),
        spawned=tuple(spawn.type for spawn in message.spawned),
        spawn_values=tuple(getattr(spawn, name) for spawn in message.spawned for name in SPAWN_VALUES),
        names=tuple(message.names),
        values=tuple(message.values),
    )


def alarm_messages(alarms: Sequence[Alarm]) -> list[AlarmMessage]:
    """Return declared alarms as conveyor_msgs/Alarm. Raise ConveyorError for a field of a wrong type or range."""
    return [*map(_alarm_message, alarms)]


def _alarm_message(alarm: Alarm) -> AlarmMessage:
    try:
        return AlarmMessage(
            id=alarm.id,
            text=alarm.text,
            alarm_class=alarm.alarm_class,
            priority=alarm.priority or 0,
            tag=alarm.tag or "",
            has_high=alarm.high is not None,
            high=float(alarm.high or 0.0),
            has_low=alarm.low is not None,
            low=float(alarm.low or 0.0),
            deadband=float(alarm.deadband),
            on_delay=float(alarm.on_delay),
            off_delay=float(alarm.off_delay),
            latching=alarm.latching,
            suppressed_by=list(alarm.suppressed_by),
            group=alarm.group,
        )
    except (AssertionError, OverflowError, TypeError, ValueError) as error:  # AssertionError: rclpy's check of a type
        raise ConveyorError(f"alarm {printable(alarm.id)}: {printable(error, SENTENCE)}") from error


def _declaration(message: Any) -> str:
    """Return a declaration in the form of inputs, JSON."""
    return Alarm(
        message.id,
        message.text,
        message.alarm_class or "warning",
        message.priority or None,
        message.tag or None,
        message.high if message.high or message.has_high else None,
        message.low if message.low or message.has_low else None,
        message.deadband,
        message.on_delay,
        message.off_delay,
        message.latching,
        tuple(message.suppressed_by),
        message.group,
    ).as_text()
