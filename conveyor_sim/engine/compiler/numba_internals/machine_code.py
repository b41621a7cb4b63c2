# SPDX-License-Identifier: Apache-2.0
"""Machine code of a kernel for arguments of certain types."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from threading import RLock
from typing import Any

import numba

_typeof: Any = numba.typeof


def entry(function: Any, *arguments: Any) -> Any:
    """Return the machine code of a kernel for arguments of these types; it must be called with no others.

    A call of it takes 1 us. Through the dispatcher it takes 20 us, because numba looks at the type of every array.
    """
    return _compiled(function, *arguments).entry_point


def address(function: Any, *arguments: Any) -> int:
    """Return the address of a kernel's machine code for arguments of these types."""
    compiled = _compiled(function, *arguments)
    pointer: int = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)
    return pointer


def _compiled(function: Any, *arguments: Any) -> Any:
    """Return numba's CompileResult for arguments of these types; compile the kernel unless it is cached."""
    types = function.narrow(_typeof(argument) for argument in arguments)
    with _rare_garbage_collection():
        function.compile(types)
    return function.overloads[types]


_collector = RLock()


@contextmanager
def _rare_garbage_collection() -> Iterator[None]:
    """Look for garbage at every 50 000th new object, not at every 700th: that saves a tenth of the time to compile."""
    with _collector:  # otherwise one thread could restore the threshold that another has raised
        previous = gc.get_threshold()
        gc.set_threshold(50_000, *previous[1:])
        try:
            yield
        finally:
            gc.set_threshold(*previous)
