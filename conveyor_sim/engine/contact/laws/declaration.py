# SPDX-License-Identifier: Apache-2.0
"""Declarations of laws of contact: functions, and data for columns, effects, bounds and predictions.

Functions are plain Python over numbers; `law_sums.py` compiles those for kernels. Such a function must not call another
one of the project, because numba compiles only the function itself. Units are those of SI.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class ElasticLaw:
    """A force that depends on the overlap alone. k: its coefficient, or its number in `curves` for a table."""

    name: str
    """Name of its effect."""
    field: str
    """Field of a contact in a scene."""
    column: str
    """Column of `ContactLaw`."""
    words: str
    force: Callable[[Any, float, Any], float]
    """For kernels: force in N from k, an overlap (m, not negative) and the curves."""
    energy: Callable[[Any, float, Any], float]
    """For kernels: stored energy in J from the same arguments."""
    deepest: Callable[[Any, float, Any], tuple[float, float]]
    """Overlap (m) and force (N) at a stored energy (J)."""
    overlap_at: Callable[[Any, float, Any], float]
    """Overlap (m) at a force (N)."""
    stiffest: Callable[[Any, float, Any], float]
    """Largest slope up to an overlap (m) or, for a table, of all its slopes, N/m."""
    duration: Callable[[Any, float, float, Any], float]
    """Lower bound of the duration of an undamped head-on impact, s, from k, reduced mass (kg), speed (m/s) and curves.
    """
    coefficient_text: Callable[[Any, Any], str]
    """Coefficient in words, as a phrase that begins with "at" or "on"."""
    none: float = 0.0
    """Value in the column of a contact that has another law."""


@dataclass(frozen=True)
class DampingLaw:
    """A force against the velocity: along the normal, or isotropic.

    A damping force along the normal is added to the elastic force, and the sum never pulls. An isotropic one also acts
    along the tangent, and may pull.
    """

    name: str
    """Its column is `damping_<name>`, its effect `<name>_damping`."""
    label: str
    """Label of its bound on the time step."""
    words: str
    law: str
    """Formula."""
    when: str
    """Description of its behaviour and use, in sentences for the docs."""
    source: str
    """Number of the paper's equation, a reference, or "added"."""
    unit: str
    """Unit of the coefficient."""
    chosen_as: str
    """Its name in a scene."""
    absent: str
    """Statement for a scene in which no contact has it."""
    needs: str
    """Parameters that it introduces."""
    force: Callable[[float, float, float, float], float]
    """For kernels: force in N from the coefficient, the elastic force (N), the overlap (m) and the closing speed (m/s).

    The overlap is not negative; at 0 there is no force.
    """
    exponent: float
    """Exponent of the overlap in the force at first touch; 0: the force jumps, 1: it grows like the elastic force."""
    coefficient: Callable[[float, float, float, float], float]
    """Coefficient from a restitution, its impact speed (m/s), the elastic coefficient and the reduced mass (kg)."""
    rebound: Callable[[str, float, float, float, float], float | str | None]
    """Restitution of an impact; None if it has no closed form; a text with the reason if there is no rebound.

    Arguments: name of the elastic law, elastic and damping coefficient, reduced mass (kg) and speed (m/s).
    """
    order: Callable[[float], float]
    """Order of convergence of an impact, as a function of the integrator's order for smooth forces."""
    stiffness_power: Callable[[str], float]
    """Exponent of the stiffness in the coefficient at constant restitution, by the name of the elastic law."""
    rate: str = "c"
    """Equivalent dashpot, kg/s, as a formula."""
    rate_at: str = ""
    """Point of an impact at which `rate` is largest, in words; empty for a constant."""
    ratio: Callable[[float, float, float, float], float] | None = None
    """Damping ratio of an impact, or of the equivalent linear impact; None: not defined for this law.

    Arguments: elastic and damping coefficient, reduced mass (kg) and speed (m/s).
    """
    applies: Callable[[str, bool], bool] = lambda elastic, by_restitution: True
    """True if a contact that names `chosen_as` gets this law.

    Arguments: name of the elastic law; True if the contact states a restitution, not a coefficient.
    """
    isotropic: bool = False

    @property
    def column(self) -> str:
        """Return the column of `ContactLaw`."""
        return f"damping_{self.name}"

    @property
    def effect(self) -> str:
        """Return the name of the effect."""
        return f"{self.name}_damping"
