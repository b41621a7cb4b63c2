"""Groups of arrays as numba sees them: addresses, not values.

A World has some 150 arrays, of seven values each. Numba takes a NamedTuple apart for every call and puts it together
again in what is called, value by value. A group is passed on by its address instead, and so are the groups in it. A
kernel begins by copying them: LLVM knows then that no array overlaps what it has of them, and once all is inlined,
nothing is left of the copies but the few values that are used.
"""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Any, TypeVar

from numba.core import cgutils, types
from numba.core.datamodel.models import TupleModel
from numba.core.imputils import lower_getattr_generic
from numba.extending import NativeValue, intrinsic, register_model, typeof_impl, unbox

Class = TypeVar("Class", bound=type)

COPIES_GROUPS = "copies_groups"
"""Attribute of a module (llvmlite) whose functions copy the groups that they are given."""


def group(cls: Class) -> Class:
    """Declare a NamedTuple as a group."""

    @typeof_impl.register(cls)
    def _typeof(value: Any, context: Any) -> Any:
        return Group([typeof_impl(member, context) for member in value], cls)

    return cls


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
    mine, inner = _by_member(names)
    return whole._replace(
        **dict.fromkeys(mine), **{name: fewer(getattr(whole, name), inside) for name, inside in inner.items()}
    )


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
def _unbox(group_type: Group, given: Any, c: Any) -> Any:
    members = [c.unbox(member, c.pyapi.tuple_getitem(given, place)) for place, member in enumerate(group_type.types)]
    failed = cgutils.false_bit
    for member in members:
        failed = c.builder.or_(failed, member.is_error)

    def clean_up() -> None:
        for member in members:
            if member.cleanup is not None:
                member.cleanup()

    value = _store(c.context, c.builder, group_type, [member.value for member in members])
    return NativeValue(value, is_error=failed, cleanup=clean_up)
