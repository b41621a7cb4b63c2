"""What an optimisation tried, as it is drawn; matplotlib is not needed for that."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.report.figures.data import Floats


@dataclass(frozen=True)
class TrialsData:
    """Points that were tried, in their order."""

    name: str
    """Of the study."""
    objective: str
    labels: tuple[str, ...]
    """Of one goal or two, with their units."""
    means: Floats
    """(trials, goals), over the seeds; NaN where a run has failed."""
    half_widths: Floats
    """(trials, goals), of their 95 % intervals; infinite or NaN: not known."""
    kept: NDArray[np.bool_]
    """(trials,) whether it keeps all bounds."""
    front: tuple[int, ...]
    """Those that no other is better than; with one goal the best."""
    maximise: bool
    """The first goal."""
    started: bool
    """Whether trial 0 is where it started."""
