# SPDX-License-Identifier: Apache-2.0
"""A run of a study: what is asked of it, and what came of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

BAGS = "bags"
"""Folder of recordings, below that of their study."""

Status = Literal["finished", "failed", "lost"]
"""A run is `lost` if its process died twice, had another version, or could not store the result. The next time that the
study runs, a lost run is repeated.
"""


@dataclass(frozen=True)
class Job:
    """One run to make. Its key is (point, seed)."""

    point: int
    """Number of the point in the design, or of a trial."""
    parameters: Mapping[str, Any]
    """Numbers, texts, true or false, by name."""
    seed: int

    @property
    def key(self) -> tuple[int, int]:
        """By which its row is kept."""
        return self.point, self.seed


@dataclass(frozen=True)
class Pilot:
    """A run by which the end of the warm-up is seen."""

    part: float
    """s, of each of its parts."""
    series: Mapping[str, Sequence[float]]
    """By metric, its value in each part."""


@dataclass(frozen=True)
class RunRow:
    """Result of a run."""

    point: int
    seed: int
    parameters: Mapping[str, Any]
    status: Status
    error: str = ""
    """One sentence, of a run that has not finished."""
    metrics: Mapping[str, float] = field(default_factory=dict)
    """By name, in SI units or as docs/studies.md says; NaN: there is none. Empty unless finished."""
    asked: Mapping[str, str] = field(default_factory=dict, compare=False)
    """By metric, what it was (`Setup.asked`), for one of the same name may have become another; empty if read from a
    Parquet file.
    """
    half_widths: Mapping[str, float | None] = field(default_factory=dict)
    """By metric that is a mean over time: of the 95 % interval by batch means of this run; None: it is too short."""
    simulated: float = 0.0
    """s, from the start of the run or of its warm start."""
    dt: float = 0.0
    """s, of a step."""
    wall: float = 0.0
    """s, to build the line and simulate it."""
    cpu: float = 0.0
    """s of a processor, the same."""
    bag: str = ""
    """Its recording, below the folder of the study; "": none."""

    @property
    def key(self) -> tuple[int, int]:
        """By which it is kept."""
        return self.point, self.seed


def point_text(parameters: Mapping[str, Any]) -> str:
    """ "length 0.7, speed 0.4"."""
    return ", ".join(f"{name} {number(value)}" for name, value in parameters.items())


def number(value: Any) -> str:
    """Return the value of a parameter as short text."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
