# SPDX-License-Identifier: Apache-2.0
"""Atomic access to entries of a column of int64, which numba lacks on a CPU, and the system's sched_yield.

All accesses are sequentially consistent.
"""

from typing import Any

from numba import types
from numba.extending import intrinsic


def _pointer(builder: Any, arguments: Any) -> Any:
    column, index = arguments[:2]
    return builder.gep(builder.extract_value(column, 0), [index])


def _load(_typing: Any, column: Any, index: Any) -> Any:
    def code(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.load_atomic(_pointer(builder, arguments), "seq_cst", 8)

    return types.int64(column, types.intp), code


def _store(_typing: Any, column: Any, index: Any, value: Any) -> Any:
    def code(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        builder.store_atomic(arguments[2], _pointer(builder, arguments), "seq_cst", 8)
        return context.get_dummy_value()

    return types.void(column, types.intp, types.int64), code


def _add(_typing: Any, column: Any, index: Any, value: Any) -> Any:
    def code(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.atomic_rmw("add", _pointer(builder, arguments), arguments[2], "seq_cst")

    return types.int64(column, types.intp, types.int64), code


load_atomic: Any = intrinsic(_load)
"""load_atomic(column, index): value of an entry."""

store_atomic: Any = intrinsic(_store)
"""store_atomic(column, index, value): write an entry."""

add_atomic: Any = intrinsic(_add)
"""add_atomic(column, index, value): add to an entry, and return its previous value."""

sched_yield: Any = types.ExternalFunction("sched_yield", types.int32())
"""sched_yield(): give the processor to another thread."""
