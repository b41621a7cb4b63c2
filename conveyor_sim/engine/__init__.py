"""The engine: compiled kernels over arrays. It imports numpy and numba and knows nothing else of the project."""
