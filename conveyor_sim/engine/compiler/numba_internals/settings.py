# SPDX-License-Identifier: Apache-2.0
"""Settings of numba and LLVM. They act on the process: on every numba function that is compiled after this import."""

from typing import Any

import llvmlite.binding as llvm
import numba

# Numba's type stubs lack SLP_VECTORIZE.
_config: Any = numba.config

# Numba leaves this part of LLVM off. It joins neighbouring loads, sums and stores into packed ones, on which gathers by
# row of `Bottles.packed` depend.
_config.SLP_VECTORIZE = 1
# That part also searches for sums over the entries of a vector. Sums of floats must keep their order, so it finds next
# to nothing, and the search took up to a fifth of compiling.
llvm.set_option("conveyor_sim", "-slp-vectorize-hor=0")
# Level 3 takes an eighth longer to compile, and no tick was faster for it.
_config.OPT = type(_config.OPT)(2)
# LLVM vectorises a loop over columns only if they don't overlap, which it tests before the loop. By default it gives up
# silently if that takes more than 8 comparisons, about four columns.
llvm.set_option("conveyor_sim", "-runtime-memory-check-threshold=1000")
llvm.set_option("conveyor_sim", "-vectorize-memory-check-threshold=1000")

OPTIONS = {
    "nopython": True, "nogil": True, "error_model": "numpy", "forceinline": True, "no_cfunc_wrapper": True,
    "_nrt": False,
}  # fmt: skip
"""Numba's options for kernels and parts.

Every function is inlined where it is called (`forceinline`): LLVM does not vectorise a loop that contains a call, and
does not inline long functions by itself. Kernels allocate nothing, so numba's reference counts (`_nrt`) are off:
otherwise every array taken out of a tuple is counted inside the loops, which costs more than the arithmetic.
"""
