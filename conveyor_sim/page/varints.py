"""Whole numbers as bytes, seven bits each, the sign in the lowest: small numbers take one byte."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

_MOST_BYTES = 10


def varints(values: ArrayLike) -> bytes:
    """Return numbers (n,) as bytes, least significant bits first; a byte's highest bit means that more follow."""
    signed = np.asarray(values, dtype=np.int64)
    rest = ((signed << 1) ^ (signed >> 63)).view(np.uint64)
    parts = np.empty((len(rest), _MOST_BYTES), dtype=np.uint8)
    used = np.zeros((len(rest), _MOST_BYTES), dtype=np.bool_)
    used[:, 0] = True
    for place in range(_MOST_BYTES):
        parts[:, place] = rest & np.uint64(0x7F)
        rest = rest >> np.uint64(7)
        more = rest > 0
        if not more.any():
            parts, used = parts[:, : place + 1], used[:, : place + 1]
            break
        parts[more, place] |= 0x80
        used[:, place + 1] = more
    return bytes(parts[used])


def packed(arrays: list[NDArray[np.int64]]) -> bytes:
    """Return arrays as bytes, each after its length."""
    return b"".join(varints([len(array)]) + varints(array) for array in arrays)


def differences(values: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the first value, then each value less the one before."""
    return np.diff(values, prepend=np.int64(0))
