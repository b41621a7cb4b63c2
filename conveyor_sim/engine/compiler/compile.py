"""How the kernels are compiled: to disk, once for each version of the engine's sources.

Numba keys its cache by the file of the function alone, so an edit in a helper would be served stale. Here the
cache folder itself is named by a hash over what all sources of the engine do (`source_hash.py`); which folder that is,
see `cache_folder.py`, and what is in it, `kernel_cache.py`.

Effects that a scene lacks arrive as ``None``: numba prunes ``if argument is None`` before it compiles, so the absent
branch is not in the machine code, and each combination is cached on disk under its own signature.
"""

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import RLock
from typing import Any, TypeVar

import llvmlite.binding as llvm
import numba

from conveyor_sim.engine.compiler.cache_folder import choose_cache_folder
from conveyor_sim.engine.compiler.kernel_cache import KernelCache, KernelFolder
from conveyor_sim.engine.compiler.numba_internals.dispatcher import KernelDispatcher
from conveyor_sim.engine.compiler.numba_internals.pipelines import KernelCompiler, PartCompiler
from conveyor_sim.engine.compiler.reads import SOURCE
from conveyor_sim.engine.compiler.source_hash import source_hash

Function = TypeVar("Function", bound=Callable[..., Any])


def engine_hash() -> str:
    """Sixteen hex digits over what the engine's sources do, and their names."""
    root = Path(__file__).parents[1]
    return source_hash(root, root.rglob("*.py"), 8)


ENGINE_HASH = engine_hash()
KERNELS = KernelFolder(*choose_cache_folder(ENGINE_HASH))

# Numba's type stubs know no SLP_VECTORIZE.
_config: Any = numba.config
_typeof: Any = numba.typeof

# These are settings of the process: they act on every numba function that is compiled after this import.
# Numba leaves this part of LLVM off: it joins neighbouring loads, sums and stores to packed ones, which gathers by row
# of `Bottles.packed` live on.
_config.SLP_VECTORIZE = 1
# It also looks for sums over the entries of a vector. Sums of floats must keep their order, so there is next to nothing
# for it to find, and the search took up to a fifth of compiling.
llvm.set_option("conveyor_sim", "-slp-vectorize-hor=0")
# Level 3 compiles for an eighth longer, and no tick was faster for it.
_config.OPT = type(_config.OPT)(2)
# A loop over columns is vectorised only if they don't overlap, which LLVM tests as it enters the loop. By default it
# gives up, silently, where that takes more than 8 comparisons, about four columns.
llvm.set_option("conveyor_sim", "-runtime-memory-check-threshold=1000")
llvm.set_option("conveyor_sim", "-vectorize-memory-check-threshold=1000")


OPTIONS = {
    "nopython": True, "nogil": True, "error_model": "numpy", "forceinline": True, "no_cfunc_wrapper": True,
    "_nrt": False,
}  # fmt: skip
"""What numba is asked for, of kernels and parts alike."""


def kernel(function: Function) -> Function:
    """Compile without the interpreter or its lock, cached on disk; IEEE arithmetic, no flag that reorders it.

    Every kernel is inlined where it is called: LLVM vectorises no loop with a call in it, and finds long ones too long.
    Kernels allocate nothing, so numba's reference counts (``_nrt``) are off: with them every column taken out of a
    tuple is counted up and down inside the loops, which costs more than the arithmetic.
    """
    return _compiled(function, no_cpython_wrapper=False)


def entry(function: Any, *arguments: Any) -> Any:
    """The machine code of a kernel for arguments of these types, to be called with no others.

    Numba would look at the type of each of a hundred arrays at every call: 20 us against 1.
    """
    return overload(function, *arguments).entry_point


def overload(function: Any, *arguments: Any) -> Any:
    """Numba's CompileResult of a kernel for arguments of these types; compiles it if need be."""
    given = tuple(_typeof(argument) for argument in arguments)
    with _rare_garbage_collection():
        function.compile(given)
    return function.overloads[given]


_collector = RLock()


@contextmanager
def _rare_garbage_collection() -> Iterator[None]:
    """Numba makes millions of objects and keeps them: to look for garbage at every 700th takes a tenth of the time."""
    with _collector:  # else one thread could put back what another has raised; numba compiles in one at a time
        previous = gc.get_threshold()
        gc.set_threshold(50_000, *previous[1:])
        try:
            yield
        finally:
            gc.set_threshold(*previous)


def part(function: Function) -> Function:
    """Compile a kernel that only kernels call: without a way in from Python, nor machine code of its own."""
    return _compiled(function, no_cpython_wrapper=True)


def _compiled(function: Function, **options: bool) -> Function:
    pipeline = PartCompiler if options["no_cpython_wrapper"] else KernelCompiler
    compiled: Any = KernelDispatcher(function, targetoptions={**OPTIONS, **options}, pipeline_class=pipeline)
    if not options["no_cpython_wrapper"]:
        compiled._cache = KernelCache(function, options, KERNELS)
    kept: Function = compiled
    return kept


def written(source: str, **names: Any) -> Any:
    """A part from the text of a function named `function`, for what numba can't loop over: fields, a list of functions.

    names: what the text uses.
    """
    names[SOURCE] = source
    exec(source, names)
    return part(names["function"])


@part
def at(column: Any, index: int) -> Any:
    """Entry of a column, or None where the effect behind the column is absent."""
    if column is None:
        return None
    return column[index]


@part
def copy(source: Any, target: Any) -> None:
    """Copy a column; an array assignment would allocate in case the two overlap."""
    for index in range(source.size):
        target[index] = source[index]


@part
def fill(column: Any, value: Any) -> None:
    """Give all entries of a column one value."""
    for index in range(column.size):
        column[index] = value
