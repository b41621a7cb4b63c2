# SPDX-License-Identifier: Apache-2.0
"""Angular spans without angles: two unit vectors and a code. So spans can wrap, and kernels need no arctangent."""

from typing import Any

from conveyor_sim.engine.compiler.compile import part

UP_TO_HALF, BEYOND_HALF, FULL_CIRCLE = 0, 1, 2


@part
def span_distance(x: float, y: float, start_x: float, start_y: float, end_x: float, end_y: float, reach: Any) -> float:
    """Return the signed distance (m) of (x, y), relative to the centre, from the span's edges: >= 0 inside.

    Its size is never more than the true distance to an edge, and its sign is exact.
    """
    if reach == FULL_CIRCLE:
        return 1e300
    after_start = start_x * y - start_y * x
    before_end = x * end_y - y * end_x
    if reach == UP_TO_HALF:
        return after_start if after_start < before_end else before_end
    return after_start if after_start > before_end else before_end
