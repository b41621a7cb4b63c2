"""What a `SceneTagProvider` and its process send each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.protocols.tags.tag_provider import Control
from conveyor_sim.scene import Scene

PATIENCE = 20.0
"""s of wall time for an orderly end once nobody is there any more."""


@dataclass(frozen=True)
class SceneTask:
    """What the process is to do, the first thing that it is sent."""

    scene: Scene
    record: Path | None
    """Folder; None: not recorded."""
    number: int
    """Of the first run, by which its folder is named, as those after resets are."""
    real_time_factor: float
    threads: int | None
    playing: bool = True
    """Whether it runs at once, and does not wait to be resumed."""
    lockstep: bool = False
    """Whether it goes as far as it is told, and no further; `playing` counts for nothing then."""


class InputRequest(NamedTuple):
    """Sent to the process: an input for the next tick."""

    given: Input


class ControlRequest(NamedTuple):
    """Sent to the process: something to do with the run."""

    what: Control
    value: float
    by: str
    """Empty: nobody has to be told."""


class TargetRequest(NamedTuple):
    """Sent to a process in lockstep: a tick to go to once the one before is reached, and what acts as it sets off."""

    target: int
    inputs: Sequence[Input]


class VariablesRequest(NamedTuple):
    """Sent to the process: what a controller's own variables are, to be recorded."""

    names: Sequence[str]
    values: Sequence[float]


class DrawingRequest(NamedTuple):
    """Sent to the process: whether what is drawn is to be copied, too."""

    on: bool


class LineCopy(NamedTuple):
    """Sent by the process: serialized messages, and how far it is with inputs."""

    states: Mapping[str, bytes]
    """By topic, the newest."""
    events: Sequence[bytes]
    handed: int
    """Inputs that have reached the stepper so far."""
    waiting: int
    """Of these, those that no tick has taken yet."""
    at: float
    """Wall time of what it shows, s since 1970."""


class UserMessage(NamedTuple):
    """Sent by the process: a sentence for people."""

    text: str
    bad: bool = False


class SimulationFailed(NamedTuple):
    """Sent by the process, the last thing: why it can't go on."""

    reason: str
