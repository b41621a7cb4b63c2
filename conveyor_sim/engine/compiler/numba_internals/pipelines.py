# SPDX-License-Identifier: Apache-2.0
"""Numba's compiler for kernels and for parts.

A part is lowered to LLVM's intermediate language and no further. Numba would make machine code of every function; here
it is made once, for a kernel with all parts that it calls, after they are inlined.
"""

from typing import Any

from llvmlite.binding import Linkage
from numba import _dynfunc  # type: ignore[attr-defined]
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, DefaultPassBuilder, _LowerResult
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.typed_passes import NativeLowering
from numba.core.untyped_passes import RewriteSemanticConstants

from conveyor_sim.engine.compiler.numba_internals.absent_members import AbsentMembers
from conveyor_sim.engine.compiler.numba_internals.group_type import COPIES_GROUPS


class _PartLibrary(JITCodeLibrary):
    """Code of a part alone. Parts that it calls remain in their own libraries."""

    def finalize(self) -> None:
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == Linkage.external:
                function.linkage = "linkonce_odr"
        self._shared_module = self._final_module
        self._finalized = True


class _KernelLibrary(JITCodeLibrary):
    """Code of a kernel and of all parts that it calls."""

    def create_ir_module(self, name: str) -> Any:
        module = super().create_ir_module(name)
        setattr(module, COPIES_GROUPS, True)
        return module

    def finalize(self) -> None:
        self._linking_libraries = list(reversed(self._callees_first(self, {})))[1:]
        super().finalize()

    def _verify_declare_only_symbols(self) -> None:
        # A function that is missing would be called at address 0.
        missing = [
            one.name for one in self._final_module.functions if one.is_declaration and one.name.startswith("_ZN")
        ]
        if missing:
            raise AssertionError(f"{self.name} calls {missing[0]}, which is not linked")

    def _callees_first(self, library: Any, order: dict[Any, None]) -> dict[Any, None]:
        """Add to `order` the libraries that a library calls, directly and through parts, then the library itself.

        LLVM links only functions that it has seen a call of, so callers of a part must be linked before it.
        """
        if library is self or isinstance(library, _PartLibrary):
            for called in library._linking_libraries:
                if called not in order:
                    self._callees_first(called, order)
        order[library] = None
        return order


@register_pass(mutates_CFG=False, analysis_only=False)
class PartEntry(LoweringPass):
    """Ends the compilation of a part, so that kernels can call it although it has no machine code."""

    _name = "part_entry"

    def __init__(self) -> None:
        LoweringPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        """Register the part with numba. Return True."""
        lowered = state.cr
        module, name = lowered.fndesc.lookup_module(), lowered.fndesc.qualname
        # Numba finds the library of a callee by this object. It is never called.
        entry = _dynfunc.make_function(module, name, "", 0, lowered.env, (state.library,))
        state.targetctx.insert_user_function(entry, lowered.fndesc, [state.library])
        state.cr = _LowerResult(lowered.fndesc, lowered.call_helper, cfunc=entry, env=lowered.env)
        return True


class _InLibrary(Compiler):
    """Numba's compiler with a library of ours and the pass `AbsentMembers`."""

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
        """Change the passes further."""


class KernelCompiler(_InLibrary):
    """Compiler of kernels: machine code with all callees."""

    library = _KernelLibrary


class PartCompiler(_InLibrary):
    """Compiler of parts: no machine code."""

    library = _PartLibrary

    def change(self, passes: Any) -> None:
        """End where machine code would be made."""
        self.state.flags.no_compile = True
        passes.add_pass_after(PartEntry, NativeLowering)
