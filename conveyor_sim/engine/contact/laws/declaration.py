"""What a law of contact declares: its functions, and what columns, effects, bounds and predictions need of it.

Functions are plain Python over numbers: `law_sums.py` compiles those that kernels use. No function calls another one of
ours then, for numba compiles only what it is given. Units are those of SI.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class ElasticLaw:
    """A force that depends on the overlap alone. k: its coefficient, or its number in `curves` for a table."""

    name: str
    """Of its effect."""
    field: str
    """Of a contact in a scene."""
    column: str
    """Of `ContactLaw`."""
    words: str
    force: Callable[[Any, float, Any], float]
    """For kernels: N from k, an overlap (m, not negative) and the curves."""
    energy: Callable[[Any, float, Any], float]
    """For kernels: what it has stored, J, likewise."""
    deepest: Callable[[Any, float, Any], tuple[float, float]]
    """Overlap (m) and force (N) at which it has stored an energy (J)."""
    overlap_at: Callable[[Any, float, Any], float]
    """Overlap (m) at a force (N)."""
    stiffest: Callable[[Any, float, Any], float]
    """Largest slope up to an overlap (m) or, for a table, of all, N/m."""
    duration: Callable[[Any, float, float, Any], float]
    """Of an undamped head-on impact, s, from k, the reduced mass (kg), a speed (m/s) and the curves; at least."""
    said: Callable[[Any, Any], str]
    """Its coefficient in words, after `at` or `on`."""
    none: float = 0.0
    """In the column of a contact that has another law."""


@dataclass(frozen=True)
class DampingLaw:
    """A force against the velocity, one of two kinds.

    Along the normal it is added to the elastic force, and the sum never pulls. An isotropic one acts along the tangent
    as well, and may pull.
    """

    name: str
    """Its column is `damping_<name>`, its effect `<name>_damping`."""
    label: str
    """Of its bound on the time step."""
    words: str
    law: str
    """As a formula."""
    when: str
    """What it does and when to choose it, in sentences for the docs."""
    source: str
    """Number of the paper's equation, a reference, or "added"."""
    unit: str
    """Of the coefficient."""
    chosen_as: str
    """Its name in a scene."""
    absent: str
    """What is missing when no contact has it."""
    needs: str
    """Parameters that it brings."""
    force: Callable[[float, float, float, float], float]
    """For kernels: N from the coefficient, the elastic force (N), the overlap (m, not negative: at 0 there is no force)
    and the speed of approach (m/s)."""
    exponent: float
    """Of the overlap, as which it grows from first touch on; 0: it sets in with a jump, 1: as the elastic force."""
    coefficient: Callable[[float, float, float, float], float]
    """From a restitution, the speed (m/s) at which it holds, the elastic coefficient and the reduced mass (kg)."""
    rebound: Callable[[str, float, float, float, float], float | str | None]
    """Restitution of an impact, from the name of the elastic law, both coefficients, elastic first, the reduced mass
    (kg) and a speed (m/s); None: it has no closed form; a text: why there is none."""
    order: Callable[[float], float]
    """Order in dt of an impact's error, from that which the integrator has where forces are smooth."""
    stiffness_power: Callable[[str], float]
    """Power of the stiffness with which it goes at constant restitution, by the name of the elastic law."""
    rate: str = "c"
    """What it is as a dashpot, kg/s, as a formula."""
    rate_at: str = ""
    """Where in an impact that is largest, in words; nothing for a constant."""
    ratio: Callable[[float, float, float, float], float] | None = None
    """Damping ratio of its impact, or of the linear one that is like it, from the elastic coefficient, its own, the
    reduced mass (kg) and the speed (m/s); None: its order is that of smooth forces, however strong it is."""
    applies: Callable[[str, bool], bool] = lambda elastic, by_restitution: True
    """Whether a contact that chooses it has it, by the name of the elastic law; else another of that name has it."""
    isotropic: bool = False

    @property
    def column(self) -> str:
        """Of `ContactLaw`."""
        return f"damping_{self.name}"

    @property
    def effect(self) -> str:
        """Name of its effect."""
        return f"{self.name}_damping"
