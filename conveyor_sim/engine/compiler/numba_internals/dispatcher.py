"""A kernel or part as other kernels call it: compiled for those members of their groups that it reads."""

from functools import cached_property
from typing import Any

from numba.core.registry import CPUDispatcher

from conveyor_sim.engine.compiler.groups import narrowed
from conveyor_sim.engine.compiler.kernel_cache import KernelCache
from conveyor_sim.engine.compiler.reads import Path, reads


class KernelDispatcher(CPUDispatcher):
    """Numba's dispatcher. A call from a kernel compiles it for what it reads of the arguments (`reads.py`)."""

    @cached_property
    def reads(self) -> list[frozenset[Path]]:
        """What it reads, by argument."""
        return reads(self.py_func)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """What numba asks for when it finds the types of a call: here it is compiled."""
        compiler: Any = vars(self)["_compiler"]
        _, given = compiler.fold_argument_types(args, kws)
        read = zip(given, self.reads, strict=True)
        return super().get_call_template(tuple(narrowed(one, paths) for one, paths in read), {})

    def compile(self, sig: Any) -> Any:
        """Machine code for arguments of these types, which other processes need not compile at the same time."""
        try:
            return super().compile(sig)
        finally:
            cache = vars(self)["_cache"]
            if isinstance(cache, KernelCache):
                cache.release()
