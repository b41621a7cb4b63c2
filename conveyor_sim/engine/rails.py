"""Contact of bottles with rails: straight pieces and arcs, found through lists made at each rebuild."""

from typing import Any

from .arc import arc_contact
from .arrays import Bottles, Load, RailContacts, RailLaw, Settings
from .compile import kernel
from .contact import contact_force
from .segment import segment_contact
from .shares import share_overlaps

MOST_CONTACTS = 32
"""Of one bottle with rails at a time, the deepest ones; as many touch only in a pocket drawn as a fine polyline."""


@kernel
def _keep(
    found: RailContacts, count: int, overlap: float, nx: float, ny: float, material: int, rail: int, surface: int
) -> int:
    if overlap <= 0.0:
        return count
    place = count
    if count == MOST_CONTACTS:
        place = 0
        for c in range(1, count):
            if found.overlap[c] < found.overlap[place]:
                place = c
        if overlap <= found.overlap[place]:
            return count
    found.overlap[place] = overlap
    found.nx[place] = nx
    found.ny[place] = ny
    found.material[place] = material
    found.rail[place] = rail
    found.surface[place] = surface
    return min(count + 1, MOST_CONTACTS)


@kernel
def _segment_contacts(i: int, bottles: Bottles, segments: Any, near: Any, found: RailContacts, count: int) -> int:
    if segments is None:
        return count
    for entry in range(near.start[i], near.start[i + 1]):
        g = near.piece[entry]
        overlap, nx, ny = segment_contact(segments, g, bottles.x[i], bottles.y[i], bottles.radius[i])
        count = _keep(found, count, overlap, nx, ny, segments.material[g], segments.rail[g], segments.surface[g])
    return count


@kernel
def _arc_contacts(i: int, bottles: Bottles, arcs: Any, near: Any, found: RailContacts, count: int) -> int:
    if arcs is None:
        return count
    for entry in range(near.start[i], near.start[i + 1]):
        k = near.piece[entry]
        overlap, nx, ny = arc_contact(arcs, k, bottles.x[i], bottles.y[i], bottles.radius[i])
        count = _keep(found, count, overlap, nx, ny, arcs.material[k], arcs.rail[k], arcs.surface[k])
    return count


@kernel
def find_rail_contacts(
    i: int, bottles: Bottles, segments: Any, near_segments: Any, arcs: Any, near_arcs: Any, found: RailContacts
) -> int:
    """Fill `found` with the contacts of bottle i with rails, shares included; return how many."""
    count = _segment_contacts(i, bottles, segments, near_segments, found, 0)
    count = _arc_contacts(i, bottles, arcs, near_arcs, found, count)
    if count == 1:
        found.share[0] = 1.0
    elif count > 1:
        share_overlaps(found, count)
    return count


@kernel
def rail_contact(
    c: int, i: int, settings: Settings, bottles: Bottles, spin: Any, found: RailContacts, law: RailLaw
) -> tuple[float, float]:
    """N and T (N) on bottle i in its contact c with a rail at rest."""
    nx, ny = found.nx[c], found.ny[c]
    closing = bottles.vx[i] * nx + bottles.vy[i] * ny
    slip = -bottles.vx[i] * ny + bottles.vy[i] * nx
    if spin is not None:
        slip += spin.omega[i] * rail_arm(found.overlap[c], bottles.radius[i], settings.lever)
    kind, material = bottles.type[i], found.material[c]
    return contact_force(
        found.overlap[c],
        found.share[c],
        closing,
        slip,
        law.stiffness[kind, material],
        _at2(law.friction, kind, material),
        _at2(law.damping_paper, kind, material),
        _at2(law.damping_normal, kind, material),
        settings.slip_limit,
    )


@kernel
def rail_arm(overlap: float, radius: float, lever: float) -> float:
    """Arm from the axis to the contact point, m: R - delta, or the paper's R."""
    return radius - lever * overlap


@kernel
def _at2(table: Any, row: int, column: int) -> Any:
    if table is None:
        return None
    return table[row, column]


@kernel
def add_rail_forces(
    settings: Settings,
    bottles: Bottles,
    spin: Any,
    load: Load,
    segments: Any,
    near_segments: Any,
    arcs: Any,
    near_arcs: Any,
    law: Any,
    found: Any,
) -> None:
    """Add the forces and moments of all rails to `load` and `spin.moment`."""
    if law is None:
        return
    for i in range(bottles.x.size):
        count = find_rail_contacts(i, bottles, segments, near_segments, arcs, near_arcs, found)
        for c in range(count):
            if found.share[c] > 0.0:
                normal, tangential = rail_contact(c, i, settings, bottles, spin, found, law)
                load.fx[i] += -normal * found.nx[c] - tangential * found.ny[c]
                load.fy[i] += -normal * found.ny[c] + tangential * found.nx[c]
                load.normal_sum[i] += normal
                load.normal_max[i] = max(load.normal_max[i], normal)
                if spin is not None:
                    spin.moment[i] += rail_arm(found.overlap[c], bottles.radius[i], settings.lever) * tangential
