# SPDX-License-Identifier: Apache-2.0
"""Calls of a kernel by the address of its machine code.

A part is compiled again in every kernel that calls it; a kernel called by its address is compiled once. That suits
rare calls: LLVM does not know what the callee writes, so the caller must load values from memory again.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from conveyor_sim.engine.compiler.numba_internals.group_type import GroupType, original
from conveyor_sim.engine.compiler.reads import WHOLE

RESULT_WORDS = 8
"""Words of 8 bytes reserved for the result of a kernel."""


def _call(_context: Any, place: Any, first: Any, second: Any) -> Any:
    present = [one for one in (first, second) if isinstance(one, GroupType)]

    def code(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        # Numba's calling convention: the status is returned, the result and the exception are written.
        result = cgutils.alloca_once(builder, ir.IntType(64), RESULT_WORDS)
        raised = cgutils.alloca_once(builder, cgutils.voidptr_t)
        # The original, because a copy whose address left the kernel would have to stay in memory.
        groups = [original(builder, one) for one in arguments[1 : 1 + len(present)]]
        kind = ir.FunctionType(ir.IntType(32), [result.type, raised.type, *(one.type for one in groups)])
        builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), [result, raised, *groups])
        return cgutils.get_null_value(cgutils.voidptr_t)

    return types.none(place, first, second), code


call: Any = intrinsic(_call)
"""call(address, group, group or None): call a kernel that raises nothing. Its result is dropped.

The address must be of a kernel for groups of these types; this is not checked.
"""

# For `reads.py`: it takes only the addresses of the groups.
call.reads = [WHOLE, frozenset(), frozenset()]
