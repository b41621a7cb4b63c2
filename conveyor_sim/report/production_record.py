"""How a recorded line produced: counters at its end, what its machines did when, and alarms."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.columns.counters import CounterColumns
from conveyor_sim.report.alarm_figures import AlarmFigures
from conveyor_sim.report.periods import Period


@dataclass(frozen=True)
class Production:
    """Of one recording."""

    scene: str
    start: float
    """s, of the first counters."""
    end: float
    """s"""
    counters: CounterColumns
    """The last ones."""
    resets: int
    """How often the line's counters were reset."""
    periods: Mapping[str, Sequence[Period]]
    """By machine, one after the other from start to end."""
    alarms: AlarmFigures
    time: NDArray[np.float64]
    """(n,), s, of each counters message."""
    good: NDArray[np.float64]
    """(n,), good bottles that had left the line by then, since the start of the recording."""
    forced: Sequence[str] = ()
    """Signals that were forced at any time."""
