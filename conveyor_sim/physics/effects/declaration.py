# SPDX-License-Identifier: Apache-2.0
"""Declaration of an effect, and the decision about it."""

from collections.abc import Callable, Collection
from dataclasses import dataclass

from conveyor_sim.physics.effects.terms import Meeting, Terms
from conveyor_sim.physics.plant import Plant
from conveyor_sim.physics.timestep.bounds import Bound
from conveyor_sim.physics.timestep.methods import Share
from conveyor_sim.physics.timestep.prediction import Term
from conveyor_sim.scene.effect_names import EffectName
from conveyor_sim.scene.problems import Path, dotted


@dataclass(frozen=True)
class Cause:
    """A field of a scene that enables an effect, and its content."""

    path: Path
    what: str = ""

    def __str__(self) -> str:
        return f"{dotted(self.path)}: {self.what}" if self.what else dotted(self.path)


@dataclass(frozen=True)
class Effect:
    """Declaration of one effect."""

    name: EffectName
    law: str
    source: str
    """Number of the paper's equation, a reference, or "added"."""
    called_for: Callable[[Plant, Collection[str]], Cause | None]
    """Returns the cause in a scene, given the earlier effects in EFFECTS that are on; None without a cause."""
    absent: str
    """Reason for its absence if no field enables it."""
    needs: str
    """State and parameters that it adds, in words."""
    absent_here: Callable[[Plant, Collection[str]], str] | None = None
    """Returns the reason for its absence from one scene, given the earlier effects; "" or None: as in `absent`."""
    bounds: Callable[[Terms], list[Bound]] | None = None
    """Returns its bounds on dt; None without bounds."""
    bound: str = ""
    """Its bounds in words."""
    shares: Callable[[Meeting, Terms], list[Share]] | None = None
    """Returns its contributions to the error in the peak force of an impact; None: it has none."""
    share: str = ""
    """These errors in words, without the integrator's coefficient."""
    resting: Callable[[Terms, float], list[Term]] | None = None
    """Returns its errors in resting load at a time step in s; None: it has none."""
    rest: str = ""
    """These errors in words."""
    side: Callable[[Terms, float], list[Term]] | None = None
    """Returns its errors in quantities other than contact force, at a time step in s; None: it has none."""
    beside: str = ""
    """These errors in words."""
    can_force_on: bool = False
    """True if it needs only parameters that every scene has."""
    can_force_off: bool = True
    """True if a scene that enables it is also valid without it."""


@dataclass(frozen=True)
class EffectChoice:
    """Decision about one effect for a scene, and the reason."""

    name: EffectName
    on: bool
    why: str
    path: Path | None
    """The field that decides; None if nothing in the scene enables the effect."""
    forced: bool = False
