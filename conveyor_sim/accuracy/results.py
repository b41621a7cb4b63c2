# SPDX-License-Identifier: Apache-2.0
"""Results of an accuracy study as plain rows, from which tables, figures, CSV and JSON are built."""

from __future__ import annotations

import math
from dataclasses import dataclass

from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.physics.timestep.prediction import DEEP


@dataclass(frozen=True)
class Order:
    """Error of one integrator in a closed form, against the number of steps."""

    case: str
    """Name of the case, such as `head on, clamped dashpot`."""
    quantity: str
    """Compared quantity, such as `speed of rebound`."""
    integrator: str
    steps: tuple[int, ...]
    """Steps in the time that the case lasts."""
    errors: tuple[float, ...]
    """Relative, RMS over `phases` phases of entry into a step."""
    phases: int
    observed: float
    """Order in dt: slope of log error against log dt."""
    expected: float | None
    """None: the theory says nothing."""


@dataclass(frozen=True)
class Rest:
    """Reference of errors in resting load, or the reason why there is none."""

    reason: str
    """Time of settling, or the reason why no settled state was reached."""
    setting: Setting | None
    """Setting of the reference; None without a settled state."""
    doubt: float | None
    """Relative difference of the reference from that of twice the step; None where no contact stayed closed."""
    window: float
    """s, over which forces are averaged."""
    contacts: int
    """Number of contacts that stayed closed in the reference."""
    force: float
    """N, their mean forces' RMS."""


@dataclass(frozen=True)
class Horizon:
    """Comparison horizon: time from one state until a nudge has doubled."""

    start: float
    """s, simulated time of the state."""
    bottles: int
    """Present in it."""
    contacts: int
    """Closed in it."""
    by_nudge: float
    """s after the start at which a nudge of 1e-12 m had doubled; inf: not in the time looked at."""
    by_error: float
    """s at which a coarse setting's own early error had; inf likewise."""
    length: float
    """s, a whole number of ticks, compared over."""


@dataclass(frozen=True)
class Errors:
    """Errors of one setting against the reference, over all horizons."""

    position_rms: float
    """m, over bottles and ticks."""
    position_max: float
    """m"""
    peak_force: float
    """Relative: RMS over bottles of the error in the largest force, over the RMS of the largest forces: impacts."""
    impulse: float
    """Relative, likewise, of the impulse of all normal forces."""
    energy: float
    """Relative: RMS over ticks of the error in kinetic and elastic energy, over the RMS of that energy."""


@dataclass(frozen=True)
class Cost:
    """Processor time, s per simulated second: median, least and greatest of interleaved repeats."""

    median: float
    least: float
    greatest: float


@dataclass(frozen=True)
class Point:
    """A setting in the work-precision diagram."""

    setting: Setting
    dt: float
    """s"""
    predicted: float | None
    """Relative error in impacts by the bounds that choose presets; None: they say nothing of this method."""
    errors: Errors | None
    """None where it failed."""
    cost: Cost | None
    """None where it failed."""
    failure: str
    """One sentence: unstable, chattering or tunnelling, where and when; empty if it did not fail."""
    predicted_resting: float | None = None
    """Relative error in resting load, predicted likewise; None where nothing rests."""
    resting: float | None = None
    """Relative error in resting load; None where it was not measured."""
    beyond: float | None = None
    """dt over the tightest bound of stability, above 1 it may chatter or blow up; None: nothing bounds it."""

    @property
    def stable(self) -> bool:
        """Return True if its step is within every bound of stability, up to rounding."""
        return self.beyond is None or self.beyond <= 1.0 + 1e-12

    @property
    def worst(self) -> float:
        """The larger of its errors in impacts and in resting load, relative; inf where it failed."""
        return math.inf if self.errors is None else max(self.errors.peak_force, self.resting or 0.0)


@dataclass(frozen=True)
class Reference:
    """Reference of errors, with its uncertainty."""

    setting: Setting
    doubt: Errors
    """Its difference from one of half as many steps and ten times the error a step."""


@dataclass(frozen=True)
class Sample:
    """One long run."""

    setting: Setting
    seed: int
    values: dict[str, float]
    """By observable; those that the scene has."""
    cpu: float
    """s of processor time that it took."""
    failure: str
    """One sentence if the run ended early, its values are then empty; else empty."""


@dataclass(frozen=True)
class Comparison:
    """One observable under one setting, compared with the reference setting over seeds."""

    setting: Setting
    observable: str
    runs: int
    mean: float
    error: float
    """Standard error of the mean."""
    reference: float
    """Mean under the reference setting."""
    reference_error: float
    low: float
    """Confidence interval of the relative difference from the reference."""
    high: float
    tolerance: float
    verdict: str
    """`equivalent`: the interval lies inside +-tolerance; `different`: outside; `undecided`: neither."""

    @property
    def resolution(self) -> float:
        """Smallest tolerance at which the runs made would accept: the interval's end farther from 0."""
        return max(abs(self.low), abs(self.high))


@dataclass(frozen=True)
class StiffnessRow:
    """The scene with every stiffness times `factor`, at constant restitution."""

    factor: float
    dt: float
    """s, of the runs."""
    point: Point | None
    """Its place in the work-precision diagram; None if it was not put there."""
    overlap: float | None
    """Largest overlap of the runs over the diameter; None where it is not known."""
    observables: dict[str, tuple[float, float]]
    """By name: mean and standard error over seeds."""
    cost_ratio: float | None
    """Processor time over that of factor 1; None where it is not known."""

    @property
    def deep(self) -> bool:
        """Return True if overlaps are so large that the flow may not be that of stiff bottles."""
        return self.overlap is not None and self.overlap > DEEP


@dataclass(frozen=True)
class Answer:
    """The cheapest setting that can be trusted, and what a more exact one would cost."""

    setting: Setting
    dt: float
    """s"""
    error: float
    """Relative, in impacts: in peak contact force."""
    speed: float
    """Simulated over processor time."""
    exacter: Setting | None
    """The cheapest of a tenth of its error; None if no setting is so exact, the next two are then None, too."""
    exacter_error: float | None
    """Relative, in impacts or in resting load, whichever is larger."""
    exacter_cost: float | None
    """Processor time over that of `setting`."""
    sentence: str
    """All of this in words."""
    accepted: bool
    """True if the ensembles are equivalent to the reference in every observable."""
    doubts: tuple[str, ...]
    """Sentences: what is not certain."""
    resting: float | None = None
    """Relative, in resting load; None where it was not measured."""


@dataclass(frozen=True)
class FlowRow:
    """A setting of impulses, judged by counts, throughput and positions in long runs, not by forces."""

    setting: Setting
    cost: float | None
    """Processor time, s per simulated second; None where it was not measured."""
    overlap: float | None
    """Largest overlap of the long runs over the smaller diameter; None without runs."""
    stop_force: float | None
    """Relative difference of the mean stop force from the reference; None without rails or runs."""
    throughput: Comparison | None
    """None without runs, and where nothing leaves or returns."""
    single_forces: float | None
    """Relative error of single forces in resting contacts: measured, or else predicted; None where nothing rests."""
    measured: bool
    """True if `single_forces` was measured from the settled state."""
    verdict: str
    """`equivalent` in every count, rate and position; `different`, `undecided`, `too deep`, `failed` or `not run`."""
    reason: str
    """The verdict in words."""


@dataclass(frozen=True)
class FlowAnswer:
    """Settings of impulses: the cheapest one that reproduces counts and throughput, and why forces refuse it."""

    rows: tuple[FlowRow, ...]
    """The cheapest first."""
    setting: Setting | None
    """Recommended for counts and throughput; None if none was shown to be equivalent."""
    sentence: str
    """Recommendation for counts and throughput, or the reason why there is none."""
    refusal: str
    """Why it is not recommended where forces are asked for."""


@dataclass(frozen=True)
class AccuracyStudy:
    """Result of a study of a scene, from which tables, figures and files are built."""

    scene: str
    """Its name."""
    source: str
    """Its file, as given."""
    machine: str
    """Machine on which costs were measured."""
    tick: float
    """s"""
    tolerance: float
    """Relative: in impacts, in resting load, and in every observable of long runs."""
    own: Setting
    """The scene's own, as it would run without a study."""
    orders: tuple[Order, ...]
    horizons: tuple[Horizon, ...]
    reference: Reference
    points: tuple[Point, ...]
    samples: tuple[Sample, ...]
    comparisons: tuple[Comparison, ...]
    ensemble_reference: Setting | None
    """Reference setting of `comparisons`; None without ensembles."""
    stiffness: tuple[StiffnessRow, ...]
    skipped: tuple[str, ...]
    """Sentences: what was left out, and why."""
    answer: Answer | None
    """None: no setting that was tried keeps the tolerance."""
    rest: Rest | None = None
    """None in a study of a version that did not look at resting load."""
    moving: str = ""
    """A sentence on what moving rails did; empty where there are none."""
    cpu: float | None = None
    """s of processor time that the study took, compiling left out; None where it was not kept."""
    compiling: float | None = None
    """s of processor time that compiling took."""
    flow: FlowAnswer | None = None
    """None where impulses refuse the scene (`skipped` has the reason), and in a study of an earlier version."""
