# SPDX-License-Identifier: Apache-2.0
"""Expected errors in contact forces at a time step: in the peak force of impacts, and in resting load.

The relative error of a force peak is an RMS over the phases at which first touch may fall into a step. Effects
contribute parts of it (`Share`), each a power of dt. Because a peak falls between two steps, the error is (w dt)^2 / 8,
that is (pi / n)^2 / 8 at n steps per contact. Because the force of a dashpot jumps at first touch, the error is up to
c dt / m_r. The total is the root of the sum of squares. methods.py has the coefficients of each integrator.

Resting load is the mean force over 1 s of contacts that stay closed: bottles in a queue, or along the rim of a
turntable. Its error has other causes, such as a force that lags behind a turning surface.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from conveyor_sim.physics.timestep.bounds import Bound, least_steps
from conveyor_sim.physics.timestep.methods import Share

DEEP = 0.004
"""Largest ratio of overlap to diameter up to which flow was that of stiff contacts (docs/studies/stiffness_throughput).

Beyond it, throughput rises and jams become rarer, because bottles squeeze through narrow places.
"""

WHOLE_SCENE = 1.0
"""Error in peak forces of a scene with many impacts, divided by the error of one impact."""


ROUNDING = 1e-12
"""Relative error below which a figure is rounding alone and reads 0.

An error of 2^-53 per step grows as the root of the number of steps, which is up to a hundred million in a long run.
"""


@dataclass(frozen=True)
class Impact:
    """Hardest expected impact between two bottle types, or of a bottle type on a rail material."""

    what: str
    """`two bottles`, or `a bottle and a rail`."""
    at: str
    """Stiffness and speed, in words."""
    duration: float
    """s"""
    shares: tuple[Share, ...]
    left: float
    """Relative error at any time step of a method that divides its steps itself."""
    force: float
    """Peak force, N."""
    diameter: float
    """Diameter of the smaller bottle, m."""
    overlap: Callable[[float], float]
    """Returns the overlap (m) at a force (N)."""

    def error(self, dt: float) -> float:
        """Return the relative error in contact force at a time step in s."""
        return WHOLE_SCENE * math.hypot(self.left, self._of_steps(dt))

    def _of_steps(self, dt: float) -> float:
        return math.hypot(*(share.at(dt) for share in self.shares))

    def bound(self, tolerance: float) -> Bound:
        """Return the longest time step with a relative error of at most `tolerance` and `least_steps` per contact."""
        few, allowed = self.duration / least_steps(tolerance), tolerance / WHOLE_SCENE
        dt = few if self._of_steps(few) <= allowed else _root(lambda dt: self._of_steps(dt) - allowed, few)
        return Bound(f"impact of {self.what}", dt, f"{self.sentence(dt)} {self.at}")

    def sentence(self, dt: float) -> str:
        """Return the causes of the error at a time step in s, the largest first."""
        shares = sorted(self.shares, key=lambda share: -share.at(dt))
        parts = [f"{share.name} {percent(WHOLE_SCENE * share.at(dt))}" for share in shares]
        parts += [f"its own steps {percent(WHOLE_SCENE * self.left)}"] if self.left else []
        return f"{self.duration / dt:.3g} steps a contact, {', '.join(parts)},"


@dataclass(frozen=True)
class Term:
    """An error in a quantity other than contact force."""

    quantity: str
    value: float
    """Relative error."""
    reason: str


@dataclass(frozen=True)
class Prediction:
    """Expected errors of a time step."""

    value: float | None
    """Relative error in the peak force of impacts, RMS; None without impacts."""
    reason: str
    """The impact with this error, and its causes."""
    resting: float | None
    """Relative error (RMS) in resting load: mean force over 1 s of closed contacts; None without resting load."""
    resting_reason: str
    """Causes of the error in resting load."""
    terms: tuple[Term, ...]
    """Errors in other quantities."""
    force: float
    """Largest contact force that the prediction covers, N."""
    force_reason: str

    @property
    def sentence(self) -> str:
        """The errors without their reasons."""
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
    """Return the errors at a time step in s.

    resting: errors in resting load. pressing: largest resting load (N, 0 without) and its cause.
    """
    forces = [(impact.force, f"an impact of {impact.what} {impact.at}") for impact in impacts]
    force, reason = max([pressing, *forces])
    if not impacts:
        nothing = "the scene has no contact forces"
        return Prediction(None, nothing, None, nothing, tuple(terms), force, reason)
    worst = max(impacts, key=lambda impact: impact.error(dt))
    peak_reason = f"impact of {worst.what}, {worst.sentence(dt)} {worst.at}"
    rest, rest_reason = _resting(resting, pressing[0])
    return Prediction(worst.error(dt), peak_reason, rest, rest_reason, tuple(terms), force, reason)


def _resting(terms: Sequence[Term], pressing: float) -> tuple[float | None, str]:
    """Return the error in resting load and its causes. The error is the root of the sum of squares."""
    if pressing == 0.0:
        return None, "nothing presses bottles together"
    if not terms:
        return 0.0, "resting load does not depend on the time step"
    parts = sorted(terms, key=lambda term: -term.value)
    return math.hypot(*(term.value for term in parts)), "; ".join(f"{term.quantity}: {term.reason}" for term in parts)


def deepest(impacts: Sequence[Impact], force: float) -> float:
    """Return the largest overlap over the smaller diameter at a force (N), by the elastic laws; 0 without impacts."""
    return max((impact.overlap(force) / impact.diameter for impact in impacts), default=0.0)


def deep_warning(overlap: float, of: str) -> str:
    """Return a sentence on an overlap (relative to the diameter) above DEEP; empty up to it.

    of: the overlap in words, such as `overlap in impacts`.
    """
    if not overlap > DEEP:
        return ""
    return (
        f"{of}: {percent(overlap)} of the diameter, above {percent(DEEP)}: throughput, jams and dwell times may differ "
        "from those of stiff bottles (docs/accuracy.md)"
    )


def expected_deep_warning(impacts: Sequence[Impact]) -> str:
    """Return the warning about the overlap of the hardest expected impact, with its price; empty up to DEEP.

    Forces of crowds, which may be larger, are left out: their bounds are far above those of most runs. At a given speed
    an impact lasts in proportion to its overlap, and the steps per second are in inverse proportion to its duration.
    """
    overlap = max((impact.overlap(impact.force) / impact.diameter for impact in impacts), default=0.0)
    warning = deep_warning(overlap, "overlap in impacts")
    return warning and f"{warning}; contacts stiff enough take {overlap / DEEP:.2g} times the steps"


def without_rounding(error: float) -> float:
    """Return a relative error, 0 if it is rounding alone."""
    return 0.0 if abs(error) < ROUNDING else error


def percent(value: float) -> str:
    """Return a relative error as a percentage, such as `0.31 %`."""
    value = without_rounding(value)
    return f"{100.0 * value:.2g} %" if value < 1.0 else f"{100.0 * value:.0f} %"


def _root(rising: Callable[[float], float], above: float) -> float:
    """Return the root of a rising function by bisection, to the last bit. The function is positive at `above`."""
    below = 0.0
    while True:
        middle = 0.5 * (below + above)
        if not below < middle < above:
            return below
        if rising(middle) <= 0.0:
            below = middle
        else:
            above = middle
