# SPDX-License-Identifier: Apache-2.0
"""Numba's type of a column of a group: the address of its values, and their number.

Numba describes an array by seven values, and its code for an index covers every way in which arrays can be indexed.
Kernels only need `column[i]` and `column.size`: two values, and much less code.
"""

import operator
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.datamodel.models import StructModel
from numba.core.imputils import lower_builtin, lower_getattr
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature
from numba.extending import register_model
from numba.np.numpy_support import from_dtype
from numpy.typing import NDArray


class ColumnType(types.Type):
    """Type of a one-dimensional array without gaps in a group."""

    def __init__(self, dtype: Any) -> None:
        self.dtype = dtype
        super().__init__(f"Column({dtype})")


def column_type(array: NDArray[Any]) -> ColumnType:
    """Return the type of an array as a column."""
    return ColumnType(from_dtype(array.dtype))


@register_model(ColumnType)
class _ColumnModel(StructModel):
    def __init__(self, manager: Any, column: ColumnType) -> None:
        super().__init__(manager, column, [("data", types.CPointer(column.dtype)), ("size", types.intp)])


@infer_getattr
class _Members(AttributeTemplate):
    key = ColumnType

    def resolve_size(self, _column: ColumnType) -> Any:
        return types.intp


@infer_global(operator.getitem)
class _Get(AbstractTemplate):
    def generic(self, args: Any, _kws: Any) -> Any:
        column, index = args
        if isinstance(column, ColumnType) and isinstance(index, types.Integer):
            return signature(column.dtype, column, index)
        return None


@infer_global(operator.setitem)
class _Set(AbstractTemplate):
    def generic(self, args: Any, _kws: Any) -> Any:
        column, index, value = args
        if isinstance(column, ColumnType) and isinstance(index, types.Integer):
            if self.context.can_convert(value, column.dtype) is not None:
                return signature(types.none, column, index, column.dtype)
        return None


@lower_getattr(ColumnType, "size")
def _size(_context: Any, builder: Any, _column: ColumnType, value: Any) -> Any:
    return builder.extract_value(value, 1)


@lower_builtin(operator.getitem, ColumnType, types.Integer)
def _get(context: Any, builder: Any, called: Any, args: Any) -> Any:
    column, index = called.args
    return context.unpack_value(builder, column.dtype, _place(builder, args[0], args[1], index.signed))


@lower_builtin(operator.setitem, ColumnType, types.Integer, types.Any)
def _set(context: Any, builder: Any, called: Any, args: Any) -> Any:
    column, index, _ = called.args
    context.pack_value(builder, column.dtype, args[2], _place(builder, args[0], args[1], index.signed))
    return context.get_dummy_value()


def _place(builder: Any, column: Any, index: Any, signed: bool) -> Any:
    """Build code for the address of an entry. A negative index counts from the end, as with arrays."""
    word = ir.IntType(64)
    index = (builder.sext if signed else builder.zext)(index, word) if index.type.width < word.width else index
    if signed:
        from_end = builder.add(index, builder.extract_value(column, 1))
        index = builder.select(builder.icmp_signed("<", index, word(0)), from_end, index)
    return cgutils.gep(builder, builder.extract_value(column, 0), index)
