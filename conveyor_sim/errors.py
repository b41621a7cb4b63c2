# SPDX-License-Identifier: Apache-2.0
"""Exceptions of this package, one class per cause; every message is one sentence for the user."""


class ConveyorError(Exception):
    """Base of all errors that conveyor_sim raises on purpose."""


class Interrupted(ConveyorError):
    """Work that was stopped by Ctrl-C or a termination request."""


class SceneError(ConveyorError):
    """Invalid scene: one line per problem, with file, line, field, value and expectation."""


class StudyError(ConveyorError):
    """Invalid study, with one line per problem of its file; or a study that can't run."""


class CalibrationError(ConveyorError):
    """Measurements that can't be read, with one line per problem of their file; or that determine no parameter."""


class CommandError(ConveyorError):
    """Command with an unknown name or an invalid value."""


class BagError(ConveyorError):
    """Recording that can't be written, read, recovered or replayed."""


class CheckpointError(ConveyorError):
    """Checkpoint that can't be written, read or continued."""


class SimulationError(ConveyorError):
    """Simulation that can't continue. `kind`: `unstable`, or `tunnelling` if a bottle would pass through an object."""

    def __init__(self, message: str, kind: str = "unstable") -> None:
        super().__init__(message)
        self.kind = kind
