# SPDX-License-Identifier: Apache-2.0
"""All contact with internals of numba and llvmlite; see the README of the engine."""
