"""What machines of a scene file have in common."""

from collections.abc import Iterator

from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.words import shown


def rate_problems(path: Path, rate: float, limit: float | None) -> Iterator[Problem]:
    """A rate that is beyond its limit, both 1/s; path: of their machine."""
    if limit is not None and limit < rate:
        text = f"{shown(limit)} given, expected at least {rate:g} (1/s), the rate"
        yield Problem((*path, "rate_limit"), text)
