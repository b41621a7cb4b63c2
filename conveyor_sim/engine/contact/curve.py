"""Normal force from a table of overlap and force, for contacts whose law was measured or computed elsewhere."""

from conveyor_sim.engine.arrays.contacts import Curves
from conveyor_sim.engine.compiler.compile import kernel


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


@kernel
def curve_energy(curves: Curves, c: int, overlap: float) -> float:
    """Area (J) under curve c up to an overlap (m); 0 for c = -1 and without contact."""
    if c < 0 or overlap <= 0.0:
        return 0.0
    energy = 0.0
    for point in range(curves.start[c], curves.start[c + 1] - 1):
        width = curves.overlap[point + 1] - curves.overlap[point]
        slope = (curves.force[point + 1] - curves.force[point]) / width
        last = point == curves.start[c + 1] - 2
        into = overlap - curves.overlap[point]
        if into > width and not last:
            into = width
        if into > 0.0:
            energy += (curves.force[point] + 0.5 * slope * into) * into
    return energy
