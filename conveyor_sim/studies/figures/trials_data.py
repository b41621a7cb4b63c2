"""Data of the figure of an optimisation, without matplotlib."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.report.figures.data import Floats


@dataclass(frozen=True)
class TrialsData:
    """Points that were tried, in their order."""

    name: str
    """Name of the study."""
    objective: str
    labels: tuple[str, ...]
    """Names of one or two goals, with their units."""
    means: Floats
    """(trials, goals), over the seeds; NaN where a run has failed."""
    half_widths: Floats
    """(trials, goals), of their 95 % intervals; infinite or NaN: not known."""
    kept: NDArray[np.bool_]
    """(trials,) whether it keeps all bounds."""
    front: tuple[int, ...]
    """Non-dominated trials; with one goal the best trial."""
    maximise: bool
    """The first goal."""
    started: bool
    """True if trial 0 is the start point."""
