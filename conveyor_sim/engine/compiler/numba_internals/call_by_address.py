"""A kernel that calls another by the address of its machine code.

A part is compiled again in every kernel that calls it. A kernel called by its address is compiled once. That suits what
is called seldom: LLVM knows nothing of what it does, and must take values out of memory again after the call.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from conveyor_sim.engine.compiler.compile import overload
from conveyor_sim.engine.compiler.groups import Group, original
from conveyor_sim.engine.compiler.reads import WHOLE

RESULT_WORDS = 8
"""Of 8 bytes: room for what a kernel returns."""


def address(function: Any, *arguments: Any) -> int:
    """The address of a kernel's machine code for arguments of these types; compiles it if need be."""
    compiled = overload(function, *arguments)
    found: int = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)
    return found


def _call(_context: Any, place: Any, first: Any, second: Any) -> Any:
    given = [one for one in (first, second) if isinstance(one, Group)]

    def code(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        # Numba's calling convention: a status is returned, the result and what was raised are written.
        result = cgutils.alloca_once(builder, ir.IntType(64), RESULT_WORDS)
        raised = cgutils.alloca_once(builder, cgutils.voidptr_t)
        # A copy whose address left the kernel would have to stay in memory.
        groups = [original(builder, one) for one in arguments[1 : 1 + len(given)]]
        kind = ir.FunctionType(ir.IntType(32), [result.type, raised.type, *(one.type for one in groups)])
        builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), [result, raised, *groups])
        return cgutils.get_null_value(cgutils.voidptr_t)

    return types.none(place, first, second), code


call: Any = intrinsic(_call)
"""In a kernel: call(address, group, group or None) calls a kernel that raises nothing; its result is dropped.

The address must be of a kernel for groups of these types: nothing checks it.
"""

# For `reads.py`: of the groups it takes no more than their addresses.
call.reads = [WHOLE, frozenset(), frozenset()]
