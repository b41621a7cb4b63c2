# SPDX-License-Identifier: Apache-2.0
"""Data of the figures of studies and optimisations, without matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.report.figures.data import Floats


@dataclass(frozen=True)
class Response:
    """A metric over the levels of one parameter. n levels."""

    parameter: str
    metric: str
    """With its unit, as an axis shows it."""
    levels: Sequence[Any]
    """(n,), numbers in rising order, or texts."""
    mean: Floats
    """(n,), NaN where no run has finished."""
    half_width: Floats
    """(n,), of the confidence interval, NaN where it is not known."""
    label: str = ""
    """Label of the line, if there are several."""
    scattered: bool = False
    """True if each level is that of a single, scattered point, so that no line joins them."""


@dataclass(frozen=True)
class Map:
    """A metric over two parameters. n by m levels."""

    parameters: tuple[str, str]
    metric: str
    levels: tuple[Sequence[Any], Sequence[Any]]
    mean: Floats
    """(n, m), NaN where no run has finished."""


@dataclass(frozen=True)
class Indices:
    """Shares of a metric's variance, by parameter. k parameters."""

    metric: str
    parameters: Sequence[str]
    first: Floats
    """(k,), by the parameter alone."""
    first_half_width: Floats
    total: Floats
    """(k,), with all interactions."""
    total_half_width: Floats


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
