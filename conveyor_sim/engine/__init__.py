# SPDX-License-Identifier: Apache-2.0
"""Compiled kernels over arrays. The engine imports numpy, numba and llvmlite, and nothing of the project."""
