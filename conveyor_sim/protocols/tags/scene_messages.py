# SPDX-License-Identifier: Apache-2.0
"""Messages between a `SceneTagProvider` and its process."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.protocols.tags.tag_provider import Control
from conveyor_sim.run.controller_source import ControllerSource
from conveyor_sim.scene import Scene

PATIENCE = 20.0
"""Wall time for an orderly shutdown after the other process has ended, s."""


@dataclass(frozen=True)
class SceneTask:
    """Task of the process; its first message."""

    scene: Scene
    record: Path | None
    """Folder of the recordings; None: not recorded."""
    number: int
    """Number of the first run. Resets increase it, and it determines the name of the recording folder."""
    real_time_factor: float
    threads: int | None
    playing: bool = True
    """True if the run starts at once, False if it starts paused."""
    controller: ControllerSource | None = None
    """Controller that owns the line and scans at every tick; None: clients alone command it."""
    lockstep: bool = False
    """True if the run advances only to the targets that clients set; `playing` then has no effect."""


class InputRequest(NamedTuple):
    """Sent to the process: an input for the next tick."""

    input: Input


class ControlRequest(NamedTuple):
    """Sent to the process: a request to control the run."""

    what: Control
    value: float
    by: str
    """Requester, for the log; empty: the request is not logged."""


class TargetRequest(NamedTuple):
    """Sent to a process in lockstep: the next target, and the inputs to apply at the tick of the previous target."""

    target: int
    inputs: Sequence[Input]


class VariablesRequest(NamedTuple):
    """Sent to the process: internal variables of a controller, to be recorded."""

    names: Sequence[str]
    values: Sequence[float]


class DrawingRequest(NamedTuple):
    """Sent to the process: request to start or stop sending DRAWING_TOPICS."""

    on: bool


class LineUpdate(NamedTuple):
    """Sent by the process: serialized messages, and the progress with inputs."""

    states: Mapping[str, bytes]
    """Newest message by topic."""
    events: Sequence[bytes]
    handed: int
    """Number of inputs that have reached the stepper so far."""
    waiting: int
    """Number of these inputs that no tick has taken yet."""
    at: float
    """Wall time of the messages, s since 1970."""


class UserMessage(NamedTuple):
    """Sent by the process: a sentence for the user."""

    text: str
    bad: bool = False


class SimulationFailed(NamedTuple):
    """Last message of the process: the reason why it can't go on."""

    reason: str
