# SPDX-License-Identifier: Apache-2.0
"""What random scenes draw numbers by."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

Data = dict[str, Any]

fractions = st.one_of(st.integers(0, 16).map(lambda n: n / 16), st.floats(0.0, 1.0, allow_nan=False))
"""From 0 to 1: coarse, so that things coincide, or fine."""
signed = fractions.map(lambda share: 2.0 * share - 1.0)


def between(low: float, high: float) -> st.SearchStrategy[float]:
    """Evenly from low to high."""
    return fractions.map(lambda share: low + (high - low) * share)


def scaled(low: float, high: float) -> st.SearchStrategy[float]:
    """Evenly in the logarithm from low to high, both greater than 0."""
    return fractions.map(lambda share: low * (high / low) ** share)
