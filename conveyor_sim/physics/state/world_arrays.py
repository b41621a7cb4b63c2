"""The arrays of a World that change as it runs, by name, and a World with them put back."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.world import World

Arrays = dict[str, NDArray[Any]]

CONSTANT = frozenset({"settings", "pair_law", "curves", "grid", "segments", "arcs", "rail_law"})
"""Groups that the Model gives and nothing changes. What a new group holds is taken along unless it is named here."""


def changing_arrays(world: World) -> Arrays:
    """Every array of a World but the constant ones, by names such as `pairs.spring.elongation`; not copied."""
    found: Arrays = {}
    for name, group in zip(world._fields, world, strict=True):
        if name not in CONSTANT:
            _collect(name, group, found)
    return found


def with_arrays(world: World, arrays: Arrays) -> World:
    """The World with other arrays in place of its own, which may be of other lengths.

    Raises ValueError where names, types or numbers of dimensions are not those of the World's own.
    """
    own = changing_arrays(world)
    for name in sorted(own.keys() | arrays.keys()):
        is_there, expected = _kind(arrays.get(name)), _kind(own.get(name))
        if is_there != expected:
            raise ValueError(f"array {name} is {is_there}, expected {expected}")
    groups = zip(world._fields, world, strict=True)
    return world._replace(**{name: _replaced(name, group, arrays) for name, group in groups if name not in CONSTANT})


def _collect(name: str, value: Any, found: Arrays) -> None:
    if isinstance(value, np.ndarray):
        found[name] = value
    elif isinstance(value, tuple):
        for field, part in zip(value._fields, value, strict=True):  # type: ignore[attr-defined]
            _collect(f"{name}.{field}", part, found)


def _replaced(name: str, value: Any, arrays: Arrays) -> Any:
    if isinstance(value, np.ndarray):
        return arrays[name]
    if isinstance(value, tuple):
        parts = zip(value._fields, value, strict=True)  # type: ignore[attr-defined]
        return type(value)(*(_replaced(f"{name}.{field}", part, arrays) for field, part in parts))
    return value


def _kind(array: NDArray[Any] | None) -> str:
    return "missing" if array is None else f"of {array.dtype} in {array.ndim} dimensions"
