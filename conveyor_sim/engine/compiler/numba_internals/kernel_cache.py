# SPDX-License-Identifier: Apache-2.0
"""Cache of machine code, as numba's dispatchers call it.

Numba's own cache is keyed by the file of the function alone, unpickles any file, and lets two processes that compile at
the same time give one file to two kernels. Here the name of a file derives from everything that the machine code
depends on, and `KernelFolder` checks the file.
"""

import functools
import hashlib
import inspect
import pickle
import sys
from pathlib import Path
from typing import Any

import llvmlite
import numba
from numba.core import compiler, serialize
from numba.core.caching import _Cache
from numba.core.runtime.nrt import rtsys

from conveyor_sim.engine.compiler.kernel_folder import KernelFolder, checksum, require_compiling_allowed

# These have no types.
_rebuild: Any = compiler.CompileResult._rebuild
_dumps: Any = serialize.dumps


class KernelCache(_Cache):
    """Cache of one kernel. Numba calls it before it compiles the kernel, and afterwards."""

    def __init__(self, function: Any, options: dict[str, bool], folder: KernelFolder) -> None:
        self._function = function
        self._options = tuple(sorted(options.items()))
        self._folder = folder
        self._claimed: str | None = None

    @property
    def cache_path(self) -> str | None:
        """Folder of the files."""
        return None if self._folder.path is None else str(self._folder.path)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the machine code for arguments of these types, or None, which has numba compile it. Raise NotCached.

        Numba's own cache fills all tables of the compiler here. They are not needed to load, and compiling fills them.
        """
        rtsys.initialize(target_context)
        key = self._key(sig, target_context.codegen())
        name = self._name(key)
        loaded = self._load(name, key, target_context)
        if loaded is None:
            require_compiling_allowed(self._function.__qualname__)
            self._claimed = name
            if self._folder.claim(name):
                loaded = self._load(name, key, target_context)
        return loaded

    def release(self) -> None:
        """Give back the claim to a kernel that was not cached: it has been compiled, or can't be."""
        name, self._claimed = self._claimed, None
        if name is not None:
            self._folder.release(name)

    def _load(self, name: str, key: tuple[Any, ...], target_context: Any) -> Any:
        payload = self._folder.read(name)
        if payload is not None:
            try:
                stored_key, result = pickle.loads(payload)
                if stored_key == key:
                    return _rebuild(target_context, *result)
                fault = "it is of other types"
            except Exception as error:  # pickle, numba or LLVM may raise anything for a file that others wrote
                fault = f"it can't be loaded ({type(error).__name__})"
            self._folder.discard(name, fault)
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store machine code."""
        if not data.library.has_dynamic_globals:
            key = self._key(sig, data.codegen)
            self._folder.write(self._name(key), _dumps((key, data._reduce())))

    def enable(self) -> None:
        """Do nothing, because the cache is always enabled."""

    def disable(self) -> None:
        """Do nothing, because the cache is always enabled."""

    def flush(self) -> None:
        """Do nothing, because a file of another content has another name."""

    def _key(self, sig: Any, codegen: Any) -> tuple[Any, ...]:
        """Return everything that the machine code depends on, except the engine's sources, which name the folder."""
        cells = tuple(cell.cell_contents for cell in self._function.__closure__ or ())
        versions = (numba.__version__, llvmlite.__version__, sys.version)
        source = _source(inspect.getfile(self._function)), self._function.__code__.co_firstlineno
        return sig, codegen.magic_tuple(), versions, self._options, source, _dumps(cells)

    def _name(self, key: tuple[Any, ...]) -> str:
        module = Path(inspect.getfile(self._function)).stem
        digest = hashlib.blake2b(repr(key).encode(), digest_size=16).hexdigest()
        return f"{module}.{self._function.__qualname__}-{digest}.kernel"


@functools.cache
def _source(path: str) -> bytes:
    return checksum(Path(path).read_bytes())
