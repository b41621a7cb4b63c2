# SPDX-License-Identifier: Apache-2.0
"""Decorators that compile kernels. The README of the engine says what their code may contain.

Kernels are cached on disk, in a folder named by a hash over all sources of the engine. Numba keys its own cache by the
file of the function alone, so after an edit in a helper it would return outdated machine code.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from conveyor_sim.engine.compiler.cache_folder import choose_cache_folder
from conveyor_sim.engine.compiler.kernel_folder import KernelFolder
from conveyor_sim.engine.compiler.numba_internals.dispatcher import kernel_dispatcher, part_dispatcher
from conveyor_sim.engine.compiler.reads import SOURCE
from conveyor_sim.engine.compiler.source_hash import source_hash

Function = TypeVar("Function", bound=Callable[..., Any])


def engine_hash() -> str:
    """Return sixteen hex digits over the syntax of the engine's sources, and their names."""
    root = Path(__file__).parents[1]
    return source_hash(root, root.rglob("*.py"), 8)


ENGINE_HASH = engine_hash()
KERNELS = KernelFolder(*choose_cache_folder(ENGINE_HASH))


def kernel(function: Function) -> Function:
    """Compile a function that Python calls. Its machine code is cached on disk.

    It runs without the interpreter and its lock, with IEEE arithmetic: no flag allows LLVM to reorder operations.
    """
    compiled: Function = kernel_dispatcher(function, KERNELS)
    return compiled


def part(function: Function) -> Function:
    """Compile a function that only kernels call: it has neither an entry from Python nor separate machine code."""
    compiled: Function = part_dispatcher(function)
    return compiled


def written(source: str, **names: Any) -> Any:
    """Return a part from the text of a function named `function`. names: globals of the text.

    Numba can't loop over the fields of a group or over a list of functions; the text lists them.
    """
    names[SOURCE] = source
    exec(source, names)
    return part(names["function"])


@part
def at(column: Any, index: int) -> Any:
    """Return an entry of a column, or None if the effect that needs the column is absent."""
    if column is None:
        return None
    return column[index]


@part
def copy(source: Any, target: Any) -> None:
    """Copy a column. An array assignment would allocate memory in case the two overlap."""
    for index in range(source.size):
        target[index] = source[index]


@part
def fill(column: Any, value: Any) -> None:
    """Set all entries of a column to one value."""
    for index in range(column.size):
        column[index] = value
