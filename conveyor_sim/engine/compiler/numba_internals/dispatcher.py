# SPDX-License-Identifier: Apache-2.0
"""Numba's dispatcher of a kernel or part. It is compiled for the members that it reads."""

from functools import cached_property
from typing import Any

from numba.core.registry import CPUDispatcher

from conveyor_sim.engine.compiler.kernel_folder import KernelFolder
from conveyor_sim.engine.compiler.numba_internals.group_type import narrowed
from conveyor_sim.engine.compiler.numba_internals.kernel_cache import KernelCache
from conveyor_sim.engine.compiler.numba_internals.pipelines import KernelCompiler, PartCompiler
from conveyor_sim.engine.compiler.numba_internals.settings import OPTIONS
from conveyor_sim.engine.compiler.reads import Path, reads


class KernelDispatcher(CPUDispatcher):
    """Dispatcher of a kernel or part."""

    @cached_property
    def reads(self) -> list[frozenset[Path]]:
        """Paths of members that the function reads, by argument."""
        return reads(self.py_func)

    def narrow(self, types: Any) -> tuple[Any, ...]:
        """Return types of arguments with all members hidden that the function does not read."""
        return tuple(narrowed(one, paths) for one, paths in zip(types, self.reads, strict=True))

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Compile for a call from a kernel. Numba calls this when it infers the types of the call."""
        compiler: Any = vars(self)["_compiler"]
        _, types = compiler.fold_argument_types(args, kws)
        return super().get_call_template(self.narrow(types), {})

    def compile(self, sig: Any) -> Any:
        """Compile for arguments of these types; other processes wait for it instead of compiling the same."""
        narrow = self.narrow(sig)
        try:
            entry = super().compile(narrow)
        finally:
            cache = vars(self)["_cache"]
            if isinstance(cache, KernelCache):
                cache.release()
        if narrow != sig:
            # A call from Python is found by the types of its arguments, with all members.
            dispatcher: Any = self
            dispatcher._insert([one._code for one in sig], entry, False)
        return entry


def kernel_dispatcher(function: Any, folder: KernelFolder) -> Any:
    """Return a function as a kernel, whose machine code is cached in a folder."""
    options = {"no_cpython_wrapper": False}
    dispatcher: Any = KernelDispatcher(function, targetoptions={**OPTIONS, **options}, pipeline_class=KernelCompiler)
    dispatcher._cache = KernelCache(function, options, folder)
    return dispatcher


def part_dispatcher(function: Any) -> Any:
    """Return a function as a part of kernels."""
    options = {**OPTIONS, "no_cpython_wrapper": True}
    return KernelDispatcher(function, targetoptions=options, pipeline_class=PartCompiler)
