"""Normal force from a table of overlap and force, for contacts whose law was measured or computed elsewhere."""

from .arrays import Curves
from .compile import kernel


@kernel
def curve_force(curves: Curves, c: int, overlap: float) -> float:
    """Force (N) of curve c at an overlap (m): linear in between, the last slope goes on.

    0 for c = -1 and without contact. A curve has at least two entries.
    """
    if c < 0 or overlap <= 0.0:
        return 0.0
    low, high = curves.start[c], curves.start[c + 1] - 1
    while high - low > 1:
        middle = (low + high) // 2
        if curves.overlap[middle] <= overlap:
            low = middle
        else:
            high = middle
    slope = (curves.force[high] - curves.force[low]) / (curves.overlap[high] - curves.overlap[low])
    return curves.force[low] + slope * (overlap - curves.overlap[low])
