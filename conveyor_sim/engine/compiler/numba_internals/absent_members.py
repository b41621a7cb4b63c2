# SPDX-License-Identifier: Apache-2.0
"""Pass of numba's compiler that replaces absent members of groups by None, so that branches on them are pruned."""

from typing import Any

from numba.core import ir, types
from numba.core.compiler_machinery import FunctionPass, register_pass
from numba.core.ir_utils import get_definition, guard

from conveyor_sim.engine.compiler.numba_internals.group_type import GroupType


@register_pass(mutates_CFG=False, analysis_only=False)
class AbsentMembers(FunctionPass):
    """Replaces a member that a group lacks, where the group is an argument or a member of one.

    Numba prunes `if argument is None` before it infers types. With this pass it also prunes `if world.spin is None`.
    """

    _name = "absent_members"

    def __init__(self) -> None:
        FunctionPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        """Replace the members. Return True if there were any."""
        changed = False
        for block in state.func_ir.blocks.values():
            for assignment in block.find_insts(ir.Assign):
                value = assignment.value
                if _is(value, "getattr", "static_getitem") and _type(state, value) == types.none:
                    absent = ir.Const(None, assignment.loc)
                    definitions = state.func_ir._definitions[assignment.target.name]
                    definitions[definitions.index(value)] = absent
                    assignment.value = absent
                    changed = True
        return changed


def _is(value: Any, *ops: str) -> bool:
    return isinstance(value, ir.Expr) and value.op in ops


def _type(state: Any, value: Any) -> Any:
    """Return the type of an argument, or of a member of a group that is one. Return None for any other value."""
    definition = guard(get_definition, state.func_ir, value) if isinstance(value, ir.Var) else value
    if isinstance(definition, ir.Arg):
        return state.args[definition.index]
    if isinstance(definition, ir.Const) and definition.value is None:
        return types.none
    if _is(definition, "static_getitem"):
        # One of several members assigned at once: a, b = group.a, group.b
        values = guard(get_definition, state.func_ir, definition.value)
        values = guard(get_definition, state.func_ir, values.value) if _is(values, "exhaust_iter") else values
        return _type(state, values.items[definition.index]) if _is(values, "build_tuple") else None
    if _is(definition, "getattr"):
        owner = _type(state, definition.value)
        if isinstance(owner, GroupType) and definition.attr in owner.fields:
            return owner.types[owner.fields.index(definition.attr)]
    return None
