"""Groups of arrays as numba sees them: addresses, not values.

A World has some 150 arrays, of seven values each. Numba takes a NamedTuple apart for every call and puts it together
again in what is called, value by value. A group is passed on by its address instead, and so are the groups in it. A
kernel begins by copying them: LLVM knows then that no array overlaps what it has of them, and once all is inlined,
nothing is left of the copies but the few values that are used.

What is at the address is laid out in Python, once for each group (`address`): the code that numba writes to take 150
arrays apart at every call was up to half of a kernel.
"""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from functools import cache, cached_property
from typing import Any, TypeVar

import numpy as np
from numba import typeof
from numba.core import cgutils, types
from numba.core.datamodel.models import TupleModel
from numba.core.imputils import lower_getattr_generic
from numba.extending import NativeValue, intrinsic, register_model, typeof_impl, unbox

Class = TypeVar("Class", bound=type)

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
    """A group in memory, laid out as `_GroupModel.struct` has it: each value in words of 8 bytes."""

    @cached_property
    def group_type(self) -> Any:
        """Its type: that of the members."""
        return Group([typeof(member) for member in self], type(self))

    @property
    def address(self) -> int:
        """Of the layout, which lives as long as the group. Raises TypeError for a member that can't be laid out."""
        # Several threads may come here at once: all get the layout of the first.
        laid = self.__dict__.get("laid") or self.__dict__.setdefault("laid", _laid_out(self))
        found: int = laid[1]
        return found

    def __reduce__(self) -> Any:
        # A copy has arrays, and so a layout, of its own.
        return type(self), tuple(self)


def _laid_out(members: Iterable[Any]) -> tuple[Any, int]:
    words = np.array([word for member in members for word in _words(member)], np.int64)
    return words, words.ctypes.data


def _words(member: Any) -> Sequence[int]:
    if member is None:
        return (0,)
    if isinstance(member, np.ndarray):
        # Nobody owns what a kernel sees of an array (meminfo, parent): the group does.
        return (0, 0, member.size, member.itemsize, member.ctypes.data, *member.shape, *member.strides)
    if isinstance(member, _Laid):
        return (member.address,)
    if type(member) in (int, float):
        return np.array([member], np.int64 if type(member) is int else np.float64).view(np.int64).tolist()
    raise TypeError(f"member {member!r} of a group, expected an array, a group, an int, a float or None")


def without(names: Iterable[str]) -> Any:
    """For kernels: a function from a group to one of the same class without some of its members (as `fewer` has it)."""
    absent = frozenset(names)

    @intrinsic
    def fewer_members(_context: Any, whole: Any) -> Any:
        def code(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            return _stored_without(context, builder, whole, arguments[0], absent)

        return _type_without(whole, absent)(whole), code

    return fewer_members


def fewer(whole: Any, names: frozenset[str]) -> Any:
    """From Python: a group with None in place of some members. `pairs.law`: member `law` of member `pairs`."""
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


def _type_without(whole: Any, names: frozenset[str]) -> Any:
    mine, inner = _by_member(names)
    members = [
        types.none if name in mine else _type_without(member, inner[name]) if _has(member, name, inner) else member
        for name, member in zip(whole.fields, whole.types, strict=True)
    ]
    return Group(members, whole.instance_class)


def _has(member: Any, name: str, inner: Mapping[str, Any]) -> bool:
    """Whether a member, if it is there at all, has members that are to be left out."""
    return name in inner and isinstance(member, Group)


def _stored_without(context: Any, builder: Any, whole: Any, value: Any, names: frozenset[str]) -> Any:
    mine, inner = _by_member(names)
    members = []
    for place, (name, member) in enumerate(zip(whole.fields, whole.types, strict=True)):
        taken = context.get_dummy_value() if name in mine else _member(context, builder, whole, value, place)
        if _has(member, name, inner):
            taken = _stored_without(context, builder, member, taken, inner[name])
        members.append(taken)
    return _store(context, builder, _type_without(whole, names), members)


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
    """Wherever numba has a value of a group, it is the address of a struct with its members.

    The address says nothing of the struct: its type would be written out, kilobytes each, wherever a group is named.
    """

    def struct(self) -> Any:
        return super().get_value_type()

    def get_value_type(self) -> Any:
        return cgutils.voidptr_t

    get_data_type = get_argument_type = get_return_type = get_value_type

    def as_argument(self, _builder: Any, value: Any) -> Any:
        return value

    as_data = from_data = as_return = from_return = as_argument

    def from_argument(self, builder: Any, value: Any) -> Any:
        return self._copied(builder, value) if getattr(builder.module, COPIES_GROUPS, False) else value

    def _copied(self, builder: Any, value: Any) -> Any:
        copy = cgutils.alloca_once(builder, self.struct())
        for place, model in enumerate(self._models):
            member = self.member(builder, value, place)
            if isinstance(model, _GroupModel):
                member = model._copied(builder, member)
            builder.store(member, cgutils.gep_inbounds(builder, copy, 0, place))
        return builder.bitcast(copy, cgutils.voidptr_t)

    def member(self, builder: Any, value: Any, place: int) -> Any:
        """Code for a member of the group at an address."""
        struct = builder.bitcast(value, self.struct().as_pointer())
        return builder.load(cgutils.gep_inbounds(builder, struct, 0, place))


def _member(context: Any, builder: Any, group_type: Group, value: Any, place: int) -> Any:
    return context.data_model_manager[group_type].member(builder, value, place)


def _store(context: Any, builder: Any, group_type: Group, members: Sequence[Any]) -> Any:
    struct = cgutils.alloca_once(builder, context.data_model_manager[group_type].struct())
    for place, member in enumerate(members):
        builder.store(member, cgutils.gep_inbounds(builder, struct, 0, place))
    return builder.bitcast(struct, cgutils.voidptr_t)


@lower_getattr_generic(Group)
def _lower_member(context: Any, builder: Any, group_type: Group, value: Any, name: str) -> Any:
    return _member(context, builder, group_type, value, group_type.fields.index(name))


@unbox(Group)
def _unbox(_group_type: Group, given: Any, c: Any) -> Any:
    address = cgutils.alloca_once_value(c.builder, cgutils.get_null_value(cgutils.voidptr_t))
    found = c.pyapi.object_getattr_string(given, "address")
    with c.builder.if_then(cgutils.is_not_null(c.builder, found)):
        c.builder.store(c.pyapi.long_as_voidptr(found), address)
        c.pyapi.decref(found)
    value = c.builder.load(address)
    return NativeValue(value, is_error=cgutils.is_null(c.builder, value))
