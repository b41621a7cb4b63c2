"""Compiled kernels over arrays. The engine imports numpy, numba and llvmlite, and nothing of the project."""
