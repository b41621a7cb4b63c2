# SPDX-License-Identifier: Apache-2.0
"""Choice of bad bottles from one place."""

from collections.abc import Iterator
from typing import Annotated

from annotated_types import Len

from conveyor_sim.scene.parts.device_part import DevicePart
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Count, Holds, Share, quantity
from conveyor_sim.scene.words import listed


class BadBottles(DevicePart):
    """A part that bottles come from, some of them bad."""

    bad_share: Share = quantity("Share of bad bottles, drawn at random from the seed.", "1", default=0.0)
    bad_every: Count | None = quantity("Every n-th bottle is bad.", "1", default=None)
    bad_at: Annotated[tuple[Count, ...], Len(0), Holds("a list of whole numbers, 1 or greater")] = quantity(
        "Numbers of the bad bottles, counted from 1 in the order of entry: `[17, 60]`.", "1", default=()
    )

    def bad_problems(self, path: Path) -> Iterator[Problem]:
        """Yield a problem for bad bottles given in more than one way."""
        ways = {"bad_share": self.bad_share, "bad_every": self.bad_every, "bad_at": self.bad_at}
        given = [name for name, value in ways.items() if value]
        if len(given) > 1:
            yield Problem(path, f"both of {listed(given).replace(' or ', ' and ')} given, expected at most one of them")
