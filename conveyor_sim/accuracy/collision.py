"""One impact of a bottle on another or on a rail: the closed forms of its rebound, and how long it lasts.

Along the normal it is one body of the reduced mass m_r that runs onto the contact at a speed v: m_r x'' = -N(x, x').
"""

import math
from dataclasses import dataclass

import numpy as np

from conveyor_sim.accuracy.root import ROUNDING, root
from conveyor_sim.effects import choose_effects
from conveyor_sim.effects.terms import Meeting, Terms, deepest, table_of
from conveyor_sim.laws.coefficients import build_laws
from conveyor_sim.laws.restitution import clamped_restitution
from conveyor_sim.scene import Scene, rail_shapes
from conveyor_sim.timestep.presets import DEFAULT, PRESETS

SAMPLES = 2000
"""Steps of an undamped contact's order of duration by which an impact is integrated: its duration to 1e-3 of one."""

LONGEST = 40 * SAMPLES
"""Steps after which a contact is taken not to end: damped beyond a rebound."""


@dataclass(frozen=True)
class Collision:
    """What two materials do to each other head on."""

    elastic: str
    """`linear`, `hertz` or `table`."""
    damping: str
    """`paper`, `normal`, `tsuji`, `onset`, or empty."""
    meeting: Meeting
    terms: Terms

    @property
    def name(self) -> str:
        """In words, such as `linear, clamped dashpot`."""
        return f"{_ELASTIC[self.elastic]}, {_DAMPING[self.damping]}"


_ELASTIC = {"linear": "linear spring", "hertz": "Hertz", "table": "table"}
_DAMPING = {
    "": "undamped",
    "paper": "dashpot",
    "normal": "clamped dashpot",
    "tsuji": "Tsuji's dashpot",
    "onset": "damping from zero on",
}


def terms_of(scene: Scene) -> Terms:
    """A scene's coefficients, and the effects that are on."""
    on = frozenset(choice.name for choice in choose_effects(scene) if choice.on)
    return Terms(scene, build_laws(scene, rail_materials(scene), on), on, PRESETS[DEFAULT])


def rail_materials(scene: Scene) -> list[str]:
    """In the order of the entries of the rails' law."""
    return sorted({rail.material for rail in rail_shapes(scene)})


def collision_of(meeting: Meeting, terms: Terms) -> Collision:
    """Which laws act where two things meet."""
    law = meeting.law
    elastic = "linear" if meeting.value(law.stiffness) else "hertz" if meeting.value(law.hertz) else "table"
    columns = {
        "paper": law.damping_paper,
        "normal": law.damping_normal,
        "tsuji": law.damping_tsuji,
        "onset": law.damping_onset,
    }
    damping = next((name for name, column in columns.items() if meeting.value(column)), "")
    return Collision(elastic, damping, meeting, terms)


def damping_ratio(collision: Collision) -> float:
    """zeta = c / (2 sqrt(k m_r)) of a linear spring, or of the one that Hertz with Tsuji's dashpot is like."""
    law, value = collision.meeting.law, collision.meeting.value
    if collision.damping == "tsuji":
        k, c = 1.25 * value(law.hertz), value(law.damping_tsuji)
    else:
        k, c = value(law.stiffness), value(law.damping_paper) + value(law.damping_normal)
    return c / (2.0 * math.sqrt(k * collision.meeting.reduced_mass))


def rebound(collision: Collision, speed: float) -> float | str:
    """Speed after over speed before, by closed form; or why there is none."""
    if not collision.damping:
        return 1.0
    if collision.damping == "onset":
        return onset_restitution(collision.meeting.value(collision.meeting.law.damping_onset) * speed)
    if collision.damping == "tsuji" or (collision.elastic == "linear" and collision.damping == "normal"):
        return clamped_restitution(damping_ratio(collision))
    if collision.elastic == "linear":
        zeta = damping_ratio(collision)
        if zeta >= 1.0:
            return "damped beyond critical, the contact never ends"
        return math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta * zeta))
    return f"{collision.name}: its rebound has no closed form"


def onset_restitution(a: float) -> float:
    """e of N (1 + lambda v) at a = lambda v: the root of a (1 + e) = ln((1 + a) / (1 - e a))."""

    def rising(e: float) -> float:
        # By log1p, for a e and a are small where hardly anything is lost.
        return math.log1p(a) - math.log1p(-e * a) - a * (1.0 + e) if e * a < 1.0 else math.inf

    return root(rising, 0.0, min(1.0, (1.0 + ROUNDING) / a))


def peak_force(collision: Collision, speed: float) -> float | None:
    """Largest force (N) of a linear contact: v sqrt(k m_r) exp(-zeta (3 acos zeta - pi) / sqrt(1 - zeta^2)).

    None where the dashpot's jump at first touch is larger (zeta > 1/2), and for other laws.
    """
    if collision.elastic != "linear" or collision.damping not in ("", "paper", "normal"):
        return None
    zeta = damping_ratio(collision)
    if zeta > 0.5:
        return None
    meeting = collision.meeting
    undamped = speed * math.sqrt(meeting.value(meeting.law.stiffness) * meeting.reduced_mass)
    return undamped * math.exp(-zeta * (3.0 * math.acos(zeta) - math.pi) / math.sqrt(1.0 - zeta * zeta))


def duration(collision: Collision, speed: float) -> float:
    """Time (s) from first touch until the force has gone; inf if it never does.

    By integration, damping included: most laws have no formula.
    """
    overlap, _ = deepest(collision.meeting, collision.terms, speed)
    if overlap == 0.0:
        return math.inf
    force, m = _Force(collision), collision.meeting.reduced_mass
    dt = math.pi * overlap / speed / SAMPLES
    x, v, left = 0.0, speed, math.inf
    for step in range(LONGEST):
        a1 = -force(x, v) / m
        v2 = v + 0.5 * dt * a1
        a2 = -force(x + 0.5 * dt * v, v2) / m
        v3 = v + 0.5 * dt * a2
        a3 = -force(x + 0.5 * dt * v2, v3) / m
        v4 = v + dt * a3
        a4 = -force(x + dt * v3, v4) / m
        x += dt * (v + 2.0 * v2 + 2.0 * v3 + v4) / 6.0
        v += dt * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0
        before, left = left, force(x, v) if force.clamped else x
        if v < 0.0 and left <= 0.0:
            return (step + before / (before - left)) * dt
    return math.inf


class _Force:
    """N(x, x') of an impact, in N."""

    def __init__(self, collision: Collision) -> None:
        law, value = collision.meeting.law, collision.meeting.value
        self.linear, self.hertz = value(law.stiffness), value(law.hertz)
        self.table = table_of(collision.meeting, collision.terms)
        self.dashpot = value(law.damping_paper) + value(law.damping_normal)
        self.tsuji, self.onset = value(law.damping_tsuji), value(law.damping_onset)
        self.clamped = collision.damping in ("normal", "tsuji", "onset")

    def __call__(self, x: float, v: float) -> float:
        """As long as the contact lasts: it is the caller who ends it, a clamped one where this is 0."""
        x = max(x, 0.0)
        elastic = self.linear * x + self.hertz * math.pow(x, 1.5) + self._tabled(x)
        return elastic * (1.0 + self.onset * v) + (self.dashpot + self.tsuji * math.pow(x, 0.25)) * v

    def _tabled(self, x: float) -> float:
        if self.table is None:
            return 0.0
        overlap, force = self.table
        last = (force[-1] - force[-2]) / (overlap[-1] - overlap[-2])
        return float(np.interp(x, overlap, force)) + max(0.0, x - float(overlap[-1])) * float(last)
