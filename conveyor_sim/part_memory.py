"""What the parts of a line remember from tick to tick (infeeds, watchdogs, ...), as plain data and put back."""

from typing import Any

import numpy as np

from conveyor_sim.scene.part import Part


def remembered(part: Any) -> Any:
    """An object by its public attributes, or a dict or sequence of such, as data that JSON can hold.

    Pieces of a scene are left out, random generators taken by their state.
    """
    if isinstance(part, dict):
        return {str(key): remembered(value) for key, value in part.items() if not isinstance(value, Part)}
    if isinstance(part, np.random.Generator):
        return part.bit_generator.state
    if isinstance(part, np.ndarray):
        return part.tolist()
    if isinstance(part, (list, tuple)):
        return [remembered(value) for value in part]
    if hasattr(part, "__dict__"):
        return remembered({name: value for name, value in vars(part).items() if not name.startswith("_")})
    return part


def recall(part: Any, told: dict[str, Any]) -> None:
    """Put what `remembered` told of an object, or of a dict of them, back into one that is built alike.

    Raises KeyError or AttributeError for what is not there.
    """
    if isinstance(part, dict):
        for key, value in part.items():
            if value is not None:
                recall(value, told[str(key)])
        return
    for name, value in told.items():
        now = getattr(part, name)
        if isinstance(now, np.random.Generator):
            now.bit_generator.state = value
        elif isinstance(now, np.ndarray):
            now[...] = value
        elif hasattr(now, "__dict__"):
            recall(now, value)
        else:
            setattr(part, name, as_tuples(value) if isinstance(now, tuple) else value)


def as_tuples(told: Any) -> Any:
    """Lists, for JSON has no others, as the tuples that they were."""
    return tuple(map(as_tuples, told)) if isinstance(told, list) else told
