"""The force in one contact: linear penalty, damping, friction (paper eqs. 22-23, 7-10).

Between a and b, with the unit normal n from a to b and the tangent t = (-n_y, n_x): the force on a is -N n + T t, on b
its negative.
"""

from typing import Any

from .compile import kernel
from .friction import regularisation


@kernel
def contact_force(
    overlap: float,
    share: float,
    closing: float,
    slip: float,
    stiffness: float,
    friction: Any,
    damping_paper: Any,
    damping_normal: Any,
    slip_limit: float,
) -> tuple[float, float]:
    """Return (N, T) in N. Coefficients of absent effects are None.

    overlap: m, > 0. share: effective over geometric overlap, 1 for a contact on its own.
    closing: m/s, relative velocity (a less b) along n. slip: m/s, relative velocity of the contact points along t.
    stiffness: N/m (eq. 23). friction: coefficient. damping_paper: kg/s, against the whole relative velocity, not
    clamped (eq. 22). damping_normal: kg/s, along n only, and the normal force never pulls.
    """
    normal = stiffness * overlap * share
    if damping_normal is not None:
        normal += damping_normal * share * closing
        if normal < 0.0:
            normal = 0.0
    tangential = 0.0
    if damping_paper is not None:
        normal += damping_paper * share * closing
        tangential = -damping_paper * share * slip
    if friction is not None:
        # Coulomb's law needs a pressing contact: paper damping may pull at the end of a rebound.
        pressing = normal if normal > 0.0 else 0.0
        tangential -= friction * pressing * regularisation(abs(slip), slip_limit) * slip
    return normal, tangential
