# SPDX-License-Identifier: Apache-2.0
"""Root of a function, to the last digits."""

from collections.abc import Callable


def root(rising: Callable[[float], float], below: float, above: float) -> float:
    """Return a root of a function that is negative at `below` and positive at `above`, by bisection."""
    while True:
        middle = 0.5 * (below + above)
        if not below < middle < above:
            return middle
        if rising(middle) < 0.0:
            below = middle
        else:
            above = middle
