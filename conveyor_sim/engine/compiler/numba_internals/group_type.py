# SPDX-License-Identifier: Apache-2.0
"""Numba's type of a group, and the code that kernels have for it.

Numba takes a NamedTuple apart for every call and puts it together again in the callee, value by value. A group, and
every group in it, is passed by its address instead. A kernel begins by copying them: LLVM knows then that no array
overlaps the copies, and once everything is inlined, only the values in use remain.
"""

import hashlib
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.datamodel.models import TupleModel
from numba.core.imputils import lower_cast, lower_getattr_generic
from numba.extending import NativeValue, register_model, unbox
from numpy.typing import NDArray

from conveyor_sim.engine.compiler.reads import ALL, Path

WORDS = 2
"""Words of 8 bytes per member: a column takes both, a number the first; groups and other arrays are at its address."""

HIDDEN = types.Opaque("hidden")
"""Type of a member that the callee does not read."""

OWN = -1
"""Place of a group's own address, before the members."""

COPIES_GROUPS = "copies_groups"
"""Attribute of an llvmlite module whose functions copy their groups."""


class GroupType(types.NamedTuple):
    """Type of a group."""

    def __init__(self, members: Sequence[Any], cls: type) -> None:
        super().__init__(members, cls)
        # Names of functions contain those of types: with all arrays in it, a name would have kilobytes.
        self.name = f"{cls.__name__}.{hashlib.blake2b(self.name.encode(), digest_size=16).hexdigest()}"

    @property
    def key(self) -> Any:
        """Identity of the type."""
        return self.name


@cache
def narrowed(full: Any, paths: frozenset[Path]) -> Any:
    """Return the type of an argument with all members hidden that are not read (`reads.py`). The layout is the same."""
    if not isinstance(full, GroupType) or (ALL,) in paths:
        return full
    inner: dict[str, set[Path]] = {}
    for path in paths:
        if path:
            inner.setdefault(path[0], set()).add(path[1:])
    members = zip(full.fields, full.types, strict=True)
    return GroupType(
        [narrowed(member, frozenset(inner[name])) if name in inner else HIDDEN for name, member in members],
        full.instance_class,
    )


def array_struct(array: NDArray[Any]) -> NDArray[np.int64]:
    """Return numba's description of an array in memory, without an owner: meminfo and parent are null."""
    return np.array([0, 0, array.size, array.itemsize, array.ctypes.data, *array.shape, *array.strides], np.int64)


@register_model(GroupType)
class _GroupModel(TupleModel):
    """A value of a group is the address of its layout, wherever numba has one."""

    def get_value_type(self) -> Any:
        return cgutils.voidptr_t

    get_data_type = get_argument_type = get_return_type = get_value_type

    def as_argument(self, _builder: Any, value: Any) -> Any:
        return value

    as_data = from_data = as_return = from_return = as_argument

    def from_argument(self, builder: Any, value: Any) -> Any:
        return self._copied(builder, value) if getattr(builder.module, COPIES_GROUPS, False) else value

    def _copied(self, builder: Any, value: Any) -> Any:
        words = WORDS * (1 + len(self._models))
        copy = builder.bitcast(cgutils.alloca_once(builder, ir.ArrayType(ir.IntType(64), words)), cgutils.voidptr_t)
        cgutils.raw_memcpy(builder, copy, value, ir.IntType(64)(words), 8)
        for place, model in enumerate(self._models):
            # Groups and arrays at an address are copied, too.
            if isinstance(model, _GroupModel):
                inner = model._copied(builder, self.member(builder, value, place))
            elif isinstance(model.fe_type, types.Array):
                inner = cgutils.alloca_once_value(builder, self.member(builder, value, place))
            else:
                continue
            builder.store(inner, _at(builder, copy, place, inner.type))
        return copy

    def member(self, builder: Any, value: Any, place: int) -> Any:
        """Build code that reads a member of the group at an address."""
        model = self._models[place]
        kind = model.get_value_type()
        if isinstance(model.fe_type, types.Array):
            return builder.load(builder.load(_at(builder, value, place, kind.as_pointer())))
        return builder.load(_at(builder, value, place, kind))


def original(builder: Any, group_address: Any) -> Any:
    """Build code that reads the address of the layout that a group is a copy of."""
    return builder.load(_at(builder, group_address, OWN, cgutils.voidptr_t))


def _at(builder: Any, group_address: Any, place: int, kind: Any) -> Any:
    """Build code for the address of a member of an LLVM type."""
    offset = ir.IntType(32)(8 * WORDS * (1 + place))
    return builder.bitcast(builder.gep(group_address, [offset], inbounds=True), kind.as_pointer())


@lower_cast(GroupType, GroupType)
def _cast(_context: Any, _builder: Any, _from: GroupType, _to: GroupType, value: Any) -> Any:
    # The callee sees fewer members (`narrowed`).
    return value


@lower_getattr_generic(GroupType)
def _lower_member(context: Any, builder: Any, group_type: GroupType, value: Any, name: str) -> Any:
    return context.data_model_manager[group_type].member(builder, value, group_type.fields.index(name))


@unbox(GroupType)
def _unbox(_group_type: GroupType, group: Any, c: Any) -> Any:
    address = cgutils.alloca_once_value(c.builder, cgutils.get_null_value(cgutils.voidptr_t))
    number = c.pyapi.object_getattr_string(group, "address")
    with c.builder.if_then(cgutils.is_not_null(c.builder, number)):
        c.builder.store(c.pyapi.long_as_voidptr(number), address)
        c.pyapi.decref(number)
    value = c.builder.load(address)
    return NativeValue(value, is_error=cgutils.is_null(c.builder, value))
