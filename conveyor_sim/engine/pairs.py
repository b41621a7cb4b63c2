"""Contact of two bottles: overlap delta = R_i + R_j - |r_i - r_j|."""

import math
from typing import Any

from .arrays import Bottles, Load, Pairs, Settings
from .compile import at, kernel
from .contact import contact_force


@kernel
def lever_arms(overlap: float, radius_i: float, radius_j: float, lever: float) -> tuple[float, float]:
    """Arms from the axes to the contact point, m: R - delta/2 (conserves angular momentum), or the paper's R."""
    return radius_i - 0.5 * lever * overlap, radius_j - 0.5 * lever * overlap


@kernel
def pair_contact(
    p: int, settings: Settings, bottles: Bottles, spin: Any, pairs: Pairs
) -> tuple[float, float, float, float, float]:
    """Overlap (m), normal from i to j, N and T (N) of pair p; an overlap of 0 or less means no contact."""
    i, j = pairs.i[p], pairs.j[p]
    dx = bottles.x[j] - bottles.x[i]
    dy = bottles.y[j] - bottles.y[i]
    reach = bottles.radius[i] + bottles.radius[j]
    squared = dx * dx + dy * dy
    if squared >= reach * reach:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    distance = math.sqrt(squared)
    overlap = reach - distance
    # Coincident centres have no normal of their own: any will part them, the same one every time.
    nx = dx / distance if distance > 0.0 else 1.0
    ny = dy / distance if distance > 0.0 else 0.0
    vx = bottles.vx[i] - bottles.vx[j]
    vy = bottles.vy[i] - bottles.vy[j]
    closing = vx * nx + vy * ny
    slip = -vx * ny + vy * nx
    if spin is not None:
        arm_i, arm_j = lever_arms(overlap, bottles.radius[i], bottles.radius[j], settings.lever)
        slip += spin.omega[i] * arm_i + spin.omega[j] * arm_j
    normal, tangential = contact_force(
        overlap,
        1.0,
        closing,
        slip,
        pairs.stiffness[p],
        at(pairs.friction, p),
        at(pairs.damping_paper, p),
        at(pairs.damping_normal, p),
        settings.slip_limit,
    )
    return overlap, nx, ny, normal, tangential


@kernel
def add_pair_forces(settings: Settings, bottles: Bottles, spin: Any, load: Load, pairs: Any) -> None:
    """Add the forces and moments of all bottle pairs to `load` and `spin.moment`; every pair acts on both alike."""
    if pairs is None:
        return
    for p in range(pairs.used[0]):
        overlap, nx, ny, normal, tangential = pair_contact(p, settings, bottles, spin, pairs)
        if overlap > 0.0:
            i, j = pairs.i[p], pairs.j[p]
            fx = -normal * nx - tangential * ny
            fy = -normal * ny + tangential * nx
            load.fx[i] += fx
            load.fy[i] += fy
            load.fx[j] -= fx
            load.fy[j] -= fy
            load.normal_sum[i] += normal
            load.normal_sum[j] += normal
            load.normal_max[i] = max(load.normal_max[i], normal)
            load.normal_max[j] = max(load.normal_max[j], normal)
            if spin is not None:
                arm_i, arm_j = lever_arms(overlap, bottles.radius[i], bottles.radius[j], settings.lever)
                spin.moment[i] += arm_i * tangential
                spin.moment[j] += arm_j * tangential
