"""What a run may be doing, and where it reports it."""

from enum import IntEnum
from typing import Protocol


class State(IntEnum):
    """As simulation_interfaces/msg/SimulationState."""

    STOPPED = 0
    PLAYING = 1
    PAUSED = 2
    QUITTING = 3


class Log(Protocol):
    """Where the stepper writes what happened; a ROS logger or one of `logging`."""

    def info(self, message: str) -> object: ...
    def warning(self, message: str) -> object: ...
    def error(self, message: str) -> object: ...
