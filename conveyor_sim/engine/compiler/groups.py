# SPDX-License-Identifier: Apache-2.0
"""Groups of arrays: NamedTuples that kernels receive by address.

The memory at the address is laid out in Python, once per group. Numba's own code unpacks about 150 arrays in every
call, which was up to half of the size of a kernel. The offset of a member depends neither on its type nor on other
members. So code that reads a few members is compiled once for all groups in which these have the same types
(`narrowed`).
"""

from collections.abc import Sequence
from functools import cache, cached_property
from typing import Any, TypeVar

import numpy as np
from numba import typeof
from numba.extending import typeof_impl

from conveyor_sim.engine.compiler.numba_internals.column_type import column_type
from conveyor_sim.engine.compiler.numba_internals.group_type import GroupType, array_struct

Class = TypeVar("Class", bound=type)


def group(cls: Class) -> Class:
    """Declare a NamedTuple as a group."""
    body = {"__doc__": cls.__doc__, "__module__": cls.__module__, "__qualname__": cls.__qualname__}
    declared: Any = type(cls.__name__, (_Laid, cls), body)

    @typeof_impl.register(declared)
    def _typeof(value: Any, _context: Any) -> Any:
        return value.group_type

    return declared


class _Laid(tuple[Any, ...]):
    """A group with its layout in memory: its own address, then WORDS words of 8 bytes for each member."""

    @cached_property
    def group_type(self) -> Any:
        """Numba's type of the group."""
        return GroupType([_type_of(member) for member in self], type(self))

    @property
    def address(self) -> int:
        """Address of the layout, which lives as long as the group.

        Raises TypeError for a member that can't be laid out.
        """
        # Several threads may arrive here at once: all get the layout of the first one.
        layout = self.__dict__.get("layout") or self.__dict__.setdefault("layout", _laid_out(self))
        address: int = layout[-1]
        return address

    def __reduce__(self) -> Any:
        # A copy has other arrays, so it needs another layout.
        return type(self), tuple(self)


def _type_of(member: Any) -> Any:
    return column_type(member) if _is_column(member) else typeof(member)


def _is_column(member: Any) -> bool:
    # Numba refuses writes to a read-only array only if it sees it as an array.
    return isinstance(member, np.ndarray) and member.ndim == 1 and member.flags.c_contiguous and member.flags.writeable


def _laid_out(members: Sequence[Any]) -> tuple[Any, Any, int]:
    """Return arrays that must outlive the layout, the layout, and its address."""
    structs = [
        array_struct(member) if isinstance(member, np.ndarray) and not _is_column(member) else None
        for member in members
    ]
    pairs = zip(members, structs, strict=True)
    entries = [_words(member) if struct is None else (struct.ctypes.data, 0) for member, struct in pairs]
    words = np.array([(0, 0), *entries], np.int64)
    words[0, 0] = words.ctypes.data
    return structs, words, words.ctypes.data


def _words(member: Any) -> Sequence[int]:
    if member is None:
        return 0, 0
    if isinstance(member, np.ndarray):
        return member.ctypes.data, member.size
    if isinstance(member, _Laid):
        return member.address, 0
    if type(member) in (int, float):
        return int(np.array(member, np.int64 if type(member) is int else np.float64).view(np.int64)), 0
    raise TypeError(f"member {member!r} of a group, expected an array, a group, an int, a float or None")


def fewer(full: Any, names: frozenset[str]) -> Any:
    """Return a group with None in place of some members. `pairs.law` names member `law` of member `pairs`."""
    if full is None:
        return None
    # Stored, so that each view is laid out once.
    views = full.__dict__.setdefault("views", {})
    if names not in views:
        own, inner = _by_member(names)
        members = {name: fewer(getattr(full, name), inner_names) for name, inner_names in inner.items()}
        views[names] = full._replace(**dict.fromkeys(own), **members)
    return views[names]


@cache
def _by_member(names: frozenset[str]) -> tuple[frozenset[str], dict[str, frozenset[str]]]:
    """Split names into those of members and, by member, those of its members."""
    split = [name.partition(".") for name in names]
    owners = {member for member, _, inner in split if inner}
    return (
        frozenset(member for member, _, inner in split if not inner),
        {owner: frozenset(inner for member, _, inner in split if inner and member == owner) for owner in owners},
    )
