"""All contact with internals of numba and llvmlite; the README of the engine says what they are."""
