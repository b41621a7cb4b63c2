"""The errors that a time step is expected to make in contact forces: of impacts, and at rest.

An impact is a peak of force. Its relative error, RMS over the phases at which first touch may fall into a step, has
parts that effects contribute (`Share`), each a power of dt: a peak between two steps is missed by (w dt)^2 / 8, that is
(pi / n)^2 / 8 at n steps a contact; a dashpot that sets in with a jump is missed by up to c dt / m_r. Parts add up as
the root of the sum of their squares. methods.py has the coefficients of each integrator.

Resting load is the force of contacts that stay closed, as a mean over 1 s: bottles in a queue, or on a turn-table
along its rim. It is another error, of other causes: a force that lags behind a surface that turns.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from conveyor_sim.physics.timestep.bounds import Bound, least_steps
from conveyor_sim.physics.timestep.methods import Share

WHOLE_SCENE = 1.0
"""Error in the peak forces of a scene of many impacts, over that of one impact."""


@dataclass(frozen=True)
class Impact:
    """The hardest impact expected between two types of bottles, or of a type on a rail material."""

    what: str
    """`two bottles`, or `a bottle and a rail`."""
    at: str
    """Of what stiffness, at what speed, in words."""
    duration: float
    """s"""
    shares: tuple[Share, ...]
    left: float
    """What a method that divides its steps itself leaves of the error at any time step, relative."""
    force: float
    """N, its peak."""
    diameter: float
    """m, of the smaller bottle."""
    overlap: Callable[[float], float]
    """Overlap (m) at a force (N)."""

    def error(self, dt: float) -> float:
        """Relative error in contact force at a time step in s."""
        return WHOLE_SCENE * math.hypot(self.left, self._of_steps(dt))

    def _of_steps(self, dt: float) -> float:
        return math.hypot(*(share.at(dt) for share in self.shares))

    def bound(self, tolerance: float) -> Bound:
        """Longest time step of at most a relative error in contact force, and of `least_steps` a contact."""
        few, allowed = self.duration / least_steps(tolerance), tolerance / WHOLE_SCENE
        dt = few if self._of_steps(few) <= allowed else _root(lambda dt: self._of_steps(dt) - allowed, few)
        return Bound(f"impact of {self.what}", dt, f"{self.sentence(dt)} {self.at}")

    def sentence(self, dt: float) -> str:
        """What makes the error at a time step in s, the largest part first."""
        shares = sorted(self.shares, key=lambda share: -share.at(dt))
        parts = [f"{share.name} {percent(WHOLE_SCENE * share.at(dt))}" for share in shares]
        parts += [f"its own steps {percent(WHOLE_SCENE * self.left)}"] if self.left else []
        return f"{self.duration / dt:.3g} steps a contact, {', '.join(parts)},"


@dataclass(frozen=True)
class Term:
    """An error in something else than contact force."""

    quantity: str
    value: float
    """Relative."""
    reason: str


@dataclass(frozen=True)
class Prediction:
    """What a time step is expected to get wrong."""

    value: float | None
    """Relative error in the peak force of impacts, RMS; None where nothing in the scene makes one."""
    reason: str
    """The impact that has it, and why."""
    resting: float | None
    """Relative error in resting load: forces of contacts that stay closed, as means over 1 s, RMS; None where nothing
    presses bottles together."""
    resting_reason: str
    """What makes it."""
    terms: tuple[Term, ...]
    """Errors in other quantities."""
    force: float
    """N, the largest contact force that it rests on."""
    force_reason: str

    @property
    def sentence(self) -> str:
        """The numbers, without their reasons."""
        force = "no impacts" if self.value is None else f"{percent(self.value)} in the peak force of impacts"
        resting = [] if not self.resting else [f"{percent(self.resting)} in resting load"]
        return ", ".join([force, *resting, *(f"{percent(term.value)} in {term.quantity}" for term in self.terms)])


def predict(
    impacts: Sequence[Impact],
    resting: Sequence[Term],
    terms: Sequence[Term],
    pressing: tuple[float, str],
    dt: float,
) -> Prediction:
    """The errors at a time step in s.

    resting: errors in resting load. pressing: a force (N) beside those of impacts, and what presses so; 0 if nothing
    does.
    """
    forces = [(impact.force, f"an impact of {impact.what} {impact.at}") for impact in impacts]
    force, reason = max([pressing, *forces])
    if not impacts:
        nothing = "nothing makes contact forces"
        return Prediction(None, nothing, None, nothing, tuple(terms), force, reason)
    worst = max(impacts, key=lambda impact: impact.error(dt))
    peak_reason = f"impact of {worst.what}, {worst.sentence(dt)} {worst.at}"
    rest, rest_reason = _resting(resting, pressing[0])
    return Prediction(worst.error(dt), peak_reason, rest, rest_reason, tuple(terms), force, reason)


def _resting(terms: Sequence[Term], pressing: float) -> tuple[float | None, str]:
    """The error in resting load, and what makes it: independent parts, added as the root of the sum of squares."""
    if pressing == 0.0:
        return None, "nothing presses bottles together"
    if not terms:
        return 0.0, "resting load does not depend on the time step"
    parts = sorted(terms, key=lambda term: -term.value)
    return math.hypot(*(term.value for term in parts)), "; ".join(f"{term.quantity}: {term.reason}" for term in parts)


def percent(value: float) -> str:
    """A relative error as people read it: `0.31 %`."""
    return f"{100.0 * value:.2g} %" if value < 1.0 else f"{100.0 * value:.0f} %"


def _root(rising: Callable[[float], float], above: float) -> float:
    """Where a function that rises from below 0 is 0, to the last digits, by bisection; its value at `above` is not."""
    below = 0.0
    while True:
        middle = 0.5 * (below + above)
        if not below < middle < above:
            return below
        if rising(middle) <= 0.0:
            below = middle
        else:
            above = middle
