"""A kernel or part as numba calls it from others: with less than what they have, if less is read of it."""

from functools import cached_property
from typing import Any

from numba.core.registry import CPUDispatcher

from conveyor_sim.engine.compiler.groups import narrowed
from conveyor_sim.engine.compiler.reads import Path, reads


class KernelDispatcher(CPUDispatcher):
    """Numba's, but that what calls it compiles it for what it reads alone."""

    @cached_property
    def reads(self) -> list[frozenset[Path]]:
        """By argument, what it reads of it (`reads.py`)."""
        return reads(self.py_func)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """For numba, as it finds out what a call of this returns."""
        compiler: Any = vars(self)["_compiler"]
        _, given = compiler.fold_argument_types(args, kws)
        read = zip(given, self.reads, strict=True)
        return super().get_call_template(tuple(narrowed(one, paths) for one, paths in read), {})
