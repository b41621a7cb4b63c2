"""Groups of arrays as numba sees them: addresses, not values.

A World has some 150 arrays, of seven values each. Numba takes a NamedTuple apart for every call and puts it together
again in what is called, value by value. A group is passed on by its address instead, and so are the groups in it. A
kernel begins by copying them: LLVM knows then that no array overlaps what it has of them, and once all is inlined,
nothing is left of the copies but the few values that are used.

What is at the address is laid out in Python, once for each group (`address`): the code that numba writes to take 150
arrays apart at every call was up to half of a kernel. A member has the same place whatever it is and whatever else is
there, so that what looks at a few members is compiled once for all groups that have them alike (`narrowed`).
"""

import hashlib
from collections.abc import Sequence
from functools import cache, cached_property
from typing import Any, TypeVar

import numpy as np
from llvmlite import ir
from numba import typeof
from numba.core import cgutils, types
from numba.core.datamodel.models import TupleModel
from numba.core.imputils import lower_cast, lower_getattr_generic
from numba.extending import NativeValue, register_model, typeof_impl, unbox
from numba.np.numpy_support import from_dtype

from conveyor_sim.engine.compiler.numba_internals.columns import Column
from conveyor_sim.engine.compiler.reads import ALL, Path

Class = TypeVar("Class", bound=type)

WORDS = 2
"""Words of 8 bytes for a member. A column takes both (`columns.py`), a number the first; others are at its address."""

HIDDEN = types.Opaque("hidden")
"""The type of a member that is not looked at, whether it is there or not."""

OWN = -1
"""Place of a group's own address, before the members."""

COPIES_GROUPS = "copies_groups"
"""Attribute of a module (llvmlite) whose functions copy the groups that they are given."""


def group(cls: Class) -> Class:
    """Declare a NamedTuple as a group."""
    body = {"__doc__": cls.__doc__, "__module__": cls.__module__, "__qualname__": cls.__qualname__}
    kept: Any = type(cls.__name__, (_Laid, cls), body)

    @typeof_impl.register(kept)
    def _typeof(value: Any, _context: Any) -> Any:
        return value.group_type

    return kept


class _Laid(tuple[Any, ...]):
    """A group in memory: its own address, then the members, WORDS words of 8 bytes each."""

    @cached_property
    def group_type(self) -> Any:
        """Its type: that of the members."""
        return Group([_type_of(member) for member in self], type(self))

    @property
    def address(self) -> int:
        """Of the layout, which lives as long as the group. Raises TypeError for a member that can't be laid out."""
        # Several threads may come here at once: all get the layout of the first.
        laid = self.__dict__.get("laid") or self.__dict__.setdefault("laid", _laid_out(self))
        found: int = laid[-1]
        return found

    def __reduce__(self) -> Any:
        # A copy has arrays, and so a layout, of its own.
        return type(self), tuple(self)


def _type_of(member: Any) -> Any:
    return Column(from_dtype(member.dtype)) if _is_column(member) else typeof(member)


def _is_column(member: Any) -> bool:
    # Numba refuses to write to an array that is only to be read.
    return isinstance(member, np.ndarray) and member.ndim == 1 and member.flags.c_contiguous and member.flags.writeable


def _laid_out(members: Sequence[Any]) -> tuple[Any, Any, int]:
    # Nobody owns what a kernel sees of an array (meminfo, parent): the group does.
    arrays = [
        np.array([0, 0, one.size, one.itemsize, one.ctypes.data, *one.shape, *one.strides], np.int64)
        if isinstance(one, np.ndarray) and not _is_column(one)
        else None
        for one in members
    ]
    pairs = zip(members, arrays, strict=True)
    found = [_words(member) if array is None else (array.ctypes.data, 0) for member, array in pairs]
    words = np.array([(0, 0), *found], np.int64)
    words[0, 0] = words.ctypes.data
    return arrays, words, words.ctypes.data


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


def fewer(whole: Any, names: frozenset[str]) -> Any:
    """A group with None in place of some members. `pairs.law`: member `law` of member `pairs`."""
    if whole is None:
        return None
    # Kept, for each group is laid out once.
    views = whole.__dict__.setdefault("views", {})
    if names not in views:
        mine, inner = _by_member(names)
        members = {name: fewer(getattr(whole, name), inside) for name, inside in inner.items()}
        views[names] = whole._replace(**dict.fromkeys(mine), **members)
    return views[names]


@cache
def _by_member(names: frozenset[str]) -> tuple[frozenset[str], dict[str, frozenset[str]]]:
    """Those of a group's own members, and those of members of members, by member."""
    split = [name.partition(".") for name in names]
    inner = {member for member, _, inside in split if inside}
    return (
        frozenset(member for member, _, inside in split if not inside),
        {member: frozenset(inside for owner, _, inside in split if inside and owner == member) for member in inner},
    )


@cache
def narrowed(whole: Any, paths: frozenset[Path]) -> Any:
    """The type of an argument with all members hidden that are not read (`reads.py`); the layout is the same."""
    if not isinstance(whole, Group) or (ALL,) in paths:
        return whole
    inner: dict[str, set[Path]] = {}
    for path in paths:
        if path:
            inner.setdefault(path[0], set()).add(path[1:])
    members = zip(whole.fields, whole.types, strict=True)
    return Group(
        [narrowed(member, frozenset(inner[name])) if name in inner else HIDDEN for name, member in members],
        whole.instance_class,
    )


class Group(types.NamedTuple):
    """The type of a group."""

    def __init__(self, members: Sequence[Any], cls: type) -> None:
        super().__init__(members, cls)
        # Names of functions are made of those of types: with all the arrays in it, kilobytes each.
        self.name = f"{cls.__name__}.{hashlib.blake2b(self.name.encode(), digest_size=16).hexdigest()}"

    @property
    def key(self) -> Any:
        """What makes two groups the same type."""
        return self.name


@register_model(Group)
class _GroupModel(TupleModel):
    """Wherever numba has a value of a group, it is the address of its layout."""

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
            # What is at an address is copied too.
            if isinstance(model, _GroupModel):
                inner = model._copied(builder, self.member(builder, value, place))
            elif isinstance(model.fe_type, types.Array):
                inner = cgutils.alloca_once_value(builder, self.member(builder, value, place))
            else:
                continue
            builder.store(inner, _at(builder, copy, place, inner.type))
        return copy

    def member(self, builder: Any, value: Any, place: int) -> Any:
        """Code for a member of the group at an address."""
        model = self._models[place]
        kind = model.get_value_type()
        if isinstance(model.fe_type, types.Array):
            return builder.load(builder.load(_at(builder, value, place, kind.as_pointer())))
        return builder.load(_at(builder, value, place, kind))


def original(builder: Any, group_address: Any) -> Any:
    """Code for the address of the layout that a group is a copy of."""
    return builder.load(_at(builder, group_address, OWN, cgutils.voidptr_t))


def _at(builder: Any, group_address: Any, place: int, kind: Any) -> Any:
    """Code for the address of a member, of a type of LLVM's."""
    offset = ir.IntType(32)(8 * WORDS * (1 + place))
    return builder.bitcast(builder.gep(group_address, [offset], inbounds=True), kind.as_pointer())


@lower_cast(Group, Group)
def _cast(_context: Any, _builder: Any, _from: Group, _to: Group, value: Any) -> Any:
    # What is called sees less of it (`narrowed`).
    return value


@lower_getattr_generic(Group)
def _lower_member(context: Any, builder: Any, group_type: Group, value: Any, name: str) -> Any:
    return context.data_model_manager[group_type].member(builder, value, group_type.fields.index(name))


@unbox(Group)
def _unbox(_group_type: Group, given: Any, c: Any) -> Any:
    address = cgutils.alloca_once_value(c.builder, cgutils.get_null_value(cgutils.voidptr_t))
    found = c.pyapi.object_getattr_string(given, "address")
    with c.builder.if_then(cgutils.is_not_null(c.builder, found)):
        c.builder.store(c.pyapi.long_as_voidptr(found), address)
        c.pyapi.decref(found)
    value = c.builder.load(address)
    return NativeValue(value, is_error=cgutils.is_null(c.builder, value))
