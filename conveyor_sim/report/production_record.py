"""Production of a recorded line: final counters, machine periods and alarms."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.columns.counters import CounterColumns
from conveyor_sim.report.alarm_figures import AlarmFigures
from conveyor_sim.report.periods import Period


@dataclass(frozen=True)
class Production:
    """Production of one recording."""

    scene: str
    start: float
    """s, of the first counters."""
    end: float
    """s"""
    counters: CounterColumns
    """The last ones."""
    resets: int
    """Number of resets of the line's counters."""
    periods: Mapping[str, Sequence[Period]]
    """By machine, one after the other from start to end."""
    alarms: AlarmFigures
    time: NDArray[np.float64]
    """(n,), s, of each counters message."""
    good: NDArray[np.float64]
    """(n,), good bottles that had left the line by then, since the start of the recording."""
    forced: Sequence[str] = ()
    """Signals that were forced at any time."""
