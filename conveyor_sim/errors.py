"""What can go wrong, one class a cause; every message is a sentence meant for the user."""


class ConveyorError(Exception):
    """Base of all errors that conveyor_sim raises on purpose."""


class Interrupted(ConveyorError):
    """What was asked for was broken off by Ctrl-C or a request to terminate."""


class SceneError(ConveyorError):
    """A scene file that can't be: one line per problem, with file, line, field, value and what was expected."""


class StudyError(ConveyorError):
    """A study that can't be: one line per problem of its file, or what a run of it lacks."""


class CommandError(ConveyorError):
    """A command that names what is not there, or asks for what can't be."""


class BagError(ConveyorError):
    """A recording that can't be written, read, recovered or replayed."""


class CheckpointError(ConveyorError):
    """A checkpoint that can't be written, read or gone on from."""


class SimulationError(ConveyorError):
    """A simulation that can't go on. `kind`: `unstable`, or `tunnelling` for what is about to be passed through."""

    def __init__(self, message: str, kind: str = "unstable") -> None:
        super().__init__(message)
        self.kind = kind
