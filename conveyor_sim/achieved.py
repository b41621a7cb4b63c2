"""What a run reached, against what its predicted error rests on: forces up to those that were expected."""

from __future__ import annotations

from dataclasses import dataclass

from conveyor_sim.model import Model
from conveyor_sim.prediction import percent
from conveyor_sim.simulation import Simulation

HARDER = 1.05
"""Times the expected force that is still as expected: damping may add to the peak of an impact."""


@dataclass(frozen=True)
class Achieved:
    """The largest normal contact force of a run, and what it says."""

    peak_force: float
    """N"""
    expected_force: float
    """N, that the bounds on the time step and the predicted error rest on."""
    expected_of: str
    """What presses so."""
    overlap: float
    """At most so much of the smaller bottle's diameter, by the elastic laws of the contacts that there are."""

    @property
    def as_expected(self) -> bool:
        """Whether the force stayed below what the prediction rests on."""
        return self.peak_force <= HARDER * self.expected_force

    @property
    def sentence(self) -> str:
        """All of it."""
        expected = f"the {self.expected_force:.3g} N that the predicted error rests on ({self.expected_of})"
        verdict = f"within {expected}" if self.as_expected else f"more than {expected}, which may be exceeded, too"
        return (
            f"peak force {self.peak_force:.3g} N, {verdict}; "
            f"overlap at most {percent(self.overlap)} of the smaller diameter"
        )


class PeakWatch:
    """The largest contact force of a run; looked up after every tick, for peaks begin anew with outputs."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self.force = simulation.peak_force
        """N, so far; None where the scene has no effect `peaks`."""

    def after_tick(self) -> None:
        """Look."""
        now = self._simulation.peak_force
        if now is not None and self.force is not None:
            self.force = max(self.force, now)


def achieved(model: Model, peak_force: float | None) -> Achieved | None:
    """What a run came to with its largest normal contact force (N); None if it is not known, or nothing can touch."""
    if peak_force is None or not model.impacts:
        return None
    overlap = max(impact.overlap(peak_force) / impact.diameter for impact in model.impacts)
    return Achieved(peak_force, model.prediction.force, model.prediction.force_reason, overlap)
