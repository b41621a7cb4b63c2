"""Coulomb friction, regularised at low slip so that it has a direction at rest (paper eqs. 7-10)."""

from .compile import kernel


@kernel
def regularisation(slip: float, slip_limit: float) -> float:
    """p(s) / s for a slip speed s >= 0, in s/m: p = 2 s/v_lim - (s/v_lim)^2 below v_lim, else 1.

    The friction force is -mu N v p(s)/s; the quotient has no singularity at rest, where p(s)/s is 2/v_lim.
    """
    if slip < slip_limit:
        return (2.0 - slip / slip_limit) / slip_limit
    return 1.0 / slip
