"""What an effect's declaration says, and what is decided about it."""

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
    """What in a scene calls for an effect: a field, and what is in it."""

    path: Path
    what: str = ""

    def __str__(self) -> str:
        return f"{dotted(self.path)}: {self.what}" if self.what else dotted(self.path)


@dataclass(frozen=True)
class Effect:
    """One effect, declared once."""

    name: EffectName
    law: str
    source: str
    """Number of the paper's equation, a reference, or "added"."""
    called_for: Callable[[Plant, Collection[str]], Cause | None]
    """What in a scene calls for it, given the effects before it in EFFECTS that are on; None: nothing does."""
    absent: str
    """What is missing when nothing calls for it."""
    needs: str
    """State and parameters that it brings, in words."""
    absent_here: Callable[[Plant, Collection[str]], str] | None = None
    """What is missing in a scene, given the effects before it that are on; "" or None: as in `absent`."""
    bounds: Callable[[Terms], list[Bound]] | None = None
    """The bounds on dt that it brings when it is on; None: it brings none."""
    bound: str = ""
    """The same in words."""
    shares: Callable[[Meeting, Terms], list[Share]] | None = None
    """What it adds to the error in the peak force of an impact; None: nothing."""
    share: str = ""
    """The same in words, without the integrator's coefficient."""
    resting: Callable[[Terms, float], list[Term]] | None = None
    """Errors that it makes in resting load, at a time step in s; None: none."""
    rest: str = ""
    """The same in words."""
    side: Callable[[Terms, float], list[Term]] | None = None
    """Errors that it makes in something else than contact force, at a time step in s; None: none."""
    beside: str = ""
    """The same in words."""
    can_force_on: bool = False
    """Whether it needs no parameters but those that every scene has."""
    can_force_off: bool = True
    """Whether a scene that calls for it makes sense without."""


@dataclass(frozen=True)
class EffectChoice:
    """Whether an effect is on for a scene, and why."""

    name: EffectName
    on: bool
    why: str
    path: Path | None
    """The field that decides; None where nothing in the scene calls for the effect."""
    forced: bool = False
