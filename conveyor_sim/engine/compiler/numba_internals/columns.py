"""Columns of groups as numba sees them: where the values are, and how many.

Numba describes an array by seven values, and takes an index apart for every way in which arrays can be indexed. What a
kernel does with a column is `column[i]` and `column.size`. Two values are enough for that, and much less code.
"""

import operator
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.datamodel.models import StructModel
from numba.core.imputils import lower_builtin, lower_getattr
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature
from numba.extending import register_model


class Column(types.Type):
    """The type of an array of one dimension, without gaps, in a group."""

    def __init__(self, dtype: Any) -> None:
        self.dtype = dtype
        super().__init__(f"Column({dtype})")


@register_model(Column)
class _ColumnModel(StructModel):
    def __init__(self, manager: Any, column: Column) -> None:
        super().__init__(manager, column, [("data", types.CPointer(column.dtype)), ("size", types.intp)])


@infer_getattr
class _Members(AttributeTemplate):
    key = Column

    def resolve_size(self, _column: Column) -> Any:
        return types.intp


@infer_global(operator.getitem)
class _Get(AbstractTemplate):
    def generic(self, given: Any, _keywords: Any) -> Any:
        column, index = given
        if isinstance(column, Column) and isinstance(index, types.Integer):
            return signature(column.dtype, column, index)
        return None


@infer_global(operator.setitem)
class _Set(AbstractTemplate):
    def generic(self, given: Any, _keywords: Any) -> Any:
        column, index, value = given
        if isinstance(column, Column) and isinstance(index, types.Integer):
            if self.context.can_convert(value, column.dtype) is not None:
                return signature(types.none, column, index, column.dtype)
        return None


@lower_getattr(Column, "size")
def _size(_context: Any, builder: Any, _column: Column, value: Any) -> Any:
    return builder.extract_value(value, 1)


@lower_builtin(operator.getitem, Column, types.Integer)
def _get(context: Any, builder: Any, called: Any, given: Any) -> Any:
    column, index = called.args
    return context.unpack_value(builder, column.dtype, place(builder, given[0], given[1], index.signed))


@lower_builtin(operator.setitem, Column, types.Integer, types.Any)
def _set(context: Any, builder: Any, called: Any, given: Any) -> Any:
    column, index, _ = called.args
    context.pack_value(builder, column.dtype, given[2], place(builder, given[0], given[1], index.signed))
    return context.get_dummy_value()


def place(builder: Any, column: Any, index: Any, signed: bool) -> Any:
    """LLVM code for the address of an entry. A negative index counts from the end, as with arrays."""
    word = ir.IntType(64)
    index = (builder.sext if signed else builder.zext)(index, word) if index.type.width < word.width else index
    if signed:
        from_end = builder.add(index, builder.extract_value(column, 1))
        index = builder.select(builder.icmp_signed("<", index, word(0)), from_end, index)
    return cgutils.gep(builder, builder.extract_value(column, 0), index)
