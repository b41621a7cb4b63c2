"""What numba does to a kernel, and to a part of one, beside what it does to any function.

- A member of a group that is `None` is `None` to numba before it compiles, so that `if world.spin is None` prunes.
- A part is lowered to LLVM's language and no further. Numba would make machine code of every function; a part is
  inlined wherever it is called, so that is done once, in the kernels.
"""

from typing import Any

from llvmlite.binding import Linkage
from numba import _dynfunc  # type: ignore[attr-defined]
from numba.core import ir, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, DefaultPassBuilder, _LowerResult
from numba.core.compiler_machinery import FunctionPass, LoweringPass, register_pass
from numba.core.ir_utils import get_definition, guard
from numba.core.typed_passes import NativeLowering
from numba.core.untyped_passes import RewriteSemanticConstants

from conveyor_sim.engine.compiler.numba_internals.group_type import COPIES_GROUPS, GroupType


@register_pass(mutates_CFG=False, analysis_only=False)
class AbsentMembers(FunctionPass):
    """Put `None` wherever a member is taken out of a group, given as an argument, that lacks it."""

    _name = "absent_members"

    def __init__(self) -> None:
        FunctionPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        """Whether anything was changed."""
        changed = False
        for block in state.func_ir.blocks.values():
            for taken in block.find_insts(ir.Assign):
                if _is(taken.value, "getattr", "static_getitem") and _type(state, taken.value) == types.none:
                    absent = ir.Const(None, taken.loc)
                    definitions = state.func_ir._definitions[taken.target.name]
                    definitions[definitions.index(taken.value)] = absent
                    taken.value = absent
                    changed = True
        return changed


def _is(value: Any, *ops: str) -> bool:
    return isinstance(value, ir.Expr) and value.op in ops


def _type(state: Any, value: Any) -> Any:
    """Of a group that is an argument, or a member of one; None if it is anything else."""
    definition = guard(get_definition, state.func_ir, value) if isinstance(value, ir.Var) else value
    if isinstance(definition, ir.Arg):
        return state.args[definition.index]
    if isinstance(definition, ir.Const) and definition.value is None:
        return types.none
    if _is(definition, "static_getitem"):
        # One of several that are taken at once: a, b = group.a, group.b
        several = guard(get_definition, state.func_ir, definition.value)
        several = guard(get_definition, state.func_ir, several.value) if _is(several, "exhaust_iter") else several
        return _type(state, several.items[definition.index]) if _is(several, "build_tuple") else None
    if _is(definition, "getattr"):
        owner = _type(state, definition.value)
        if isinstance(owner, GroupType) and definition.attr in owner.fields:
            return owner.types[owner.fields.index(definition.attr)]
    return None


class _PartLibrary(JITCodeLibrary):
    """The code of a part alone; what it calls stays in libraries of its own."""

    def finalize(self) -> None:
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == Linkage.external:
                function.linkage = "linkonce_odr"
        self._shared_module = self._final_module
        self._finalized = True


class _KernelLibrary(JITCodeLibrary):
    """The code of a kernel, with all that it calls."""

    def create_ir_module(self, name: str) -> Any:
        module = super().create_ir_module(name)
        setattr(module, COPIES_GROUPS, True)
        return module

    def finalize(self) -> None:
        self._linking_libraries = list(reversed(self._callees_first(self, {})))[1:]
        super().finalize()

    def _verify_declare_only_symbols(self) -> None:
        # What is missing would be called at address 0.
        missing = [
            one.name for one in self._final_module.functions if one.is_declaration and one.name.startswith("_ZN")
        ]
        if missing:
            raise AssertionError(f"{self.name} calls {missing[0]}, which is not linked")

    def _callees_first(self, library: Any, order: dict[Any, None]) -> dict[Any, None]:
        """What a library calls, parts of parts included, and last itself.

        LLVM links only what it has seen a call of: whatever calls a part must be linked before it.
        """
        if library is self or isinstance(library, _PartLibrary):
            for called in library._linking_libraries:
                if called not in order:
                    self._callees_first(called, order)
        order[library] = None
        return order


@register_pass(mutates_CFG=False, analysis_only=False)
class PartEntry(LoweringPass):
    """Let others call a part that has no machine code."""

    _name = "part_entry"

    def __init__(self) -> None:
        LoweringPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        """Always changes something."""
        lowered = state.cr
        module, name = lowered.fndesc.lookup_module(), lowered.fndesc.qualname
        # Numba finds the library of what is called by this object; nobody calls it.
        entry = _dynfunc.make_function(module, name, "", 0, lowered.env, (state.library,))
        state.targetctx.insert_user_function(entry, lowered.fndesc, [state.library])
        state.cr = _LowerResult(lowered.fndesc, lowered.call_helper, cfunc=entry, env=lowered.env)
        return True


class _InLibrary(Compiler):
    library: type[JITCodeLibrary]

    def define_pipelines(self) -> list[Any]:
        state = self.state
        state.library = self.library(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        passes = DefaultPassBuilder.define_nopython_pipeline(state)
        passes.add_pass_after(AbsentMembers, RewriteSemanticConstants)
        self.change(passes)
        passes.finalize()
        return [passes]

    def change(self, passes: Any) -> None:
        """More changes to the passes."""


class KernelCompiler(_InLibrary):
    """For kernels: numba's own passes, and the code of all that is called."""

    library = _KernelLibrary


class PartCompiler(_InLibrary):
    """For parts: no machine code."""

    library = _PartLibrary

    def change(self, passes: Any) -> None:
        """Stop where machine code would be made."""
        self.state.flags.no_compile = True
        passes.add_pass_after(PartEntry, NativeLowering)
