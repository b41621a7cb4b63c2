# SPDX-License-Identifier: Apache-2.0
"""Numbers of bottles of a recording at a tick: the one set of counts of summaries, figures and reports."""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.columns.events import EventColumns


@dataclass(frozen=True)
class BottleCounts:
    """Numbers of bottles at one tick of a recording.

    `initial` + `fed` + `spawned` = `removed` + `deleted` + `present` + `held`.
    Numbers that were not recorded are None: `present` and `held` without bottles, all but `present` without events.
    """

    initial: int | None
    """Bottles on the line, or held in machines, at the start of the recording."""
    fed: int | None
    """Fed since then."""
    removed: int | None
    """Removed since then, rejected bottles included."""
    rejected: int | None
    spawned: int | None
    """Placed by inputs."""
    deleted: int | None
    """Removed by inputs."""
    held: int | None
    """Held in machines, which will give them back."""
    present: int | None
    """On the line."""

    @property
    def sentence(self) -> str:
        """Return one sentence with these numbers."""
        rejected = f" ({self.rejected} rejected)" if self.rejected else ""
        parts = [
            f"{self.initial} at the start" if self.initial else "",
            "fed and removed not recorded" if self.fed is None else f"{self.fed} fed, {self.removed} removed{rejected}",
            f"{self.spawned} placed and {self.deleted} removed by inputs" if self.spawned or self.deleted else "",
            "" if self.present is None else f"{self.present} on the line",
            f"{self.held} held in machines" if self.held else "",
        ]
        return ", ".join(part for part in parts if part)


_KINDS = ("bottle_fed", "bottle_removed", "bottle_rejected", "bottle_spawned", "bottle_deleted")


class BottleCounter:
    """Counts bottles while a recording is read."""

    def __init__(self, has_events: bool) -> None:
        """Start without bottles.

        has_events: True if the recording has the topic `events`, even without a message.
        """
        self._has_events = has_events
        self._ticks: dict[str, list[int]] = {kind: [] for kind in _KINDS}
        """Ticks of bottle events, ascending, by kind."""
        self._first_fed = math.inf
        self._unfed: set[int] = set()
        """Ids below that of the first bottle fed so far."""

    def take_events(self, events: EventColumns) -> None:
        """Add the next events of the recording."""
        for at, kind, bottle in zip(events.at.tolist(), events.kind, events.bottle.tolist(), strict=True):
            if kind in self._ticks:
                # An input is applied at the start of a scan, and seen in the state at its end.
                self._ticks[kind].append(at + (kind in ("bottle_spawned", "bottle_deleted")))
                if kind in ("bottle_fed", "bottle_spawned"):
                    self._first_fed = min(self._first_fed, bottle)
                elif bottle < self._first_fed:
                    self._unfed.add(bottle)

    def take_bottles(self, ids: NDArray[np.uint64]) -> None:
        """Add the next recorded bottles (n,) on the line."""
        self._unfed.update(ids[ids < self._first_fed].tolist())

    def at(self, tick: int, present: int | None) -> BottleCounts:
        """Return the counts of a tick, after the complete recording was read.

        present: bottles on the line at that tick; None if they were not recorded.
        """
        if not self._has_events:
            return BottleCounts(None, None, None, None, None, None, None, present)
        fed, left, rejected, spawned, deleted = (bisect_right(ticks, tick) for ticks in self._ticks.values())
        removed, initial = left + rejected, self._initial
        held = None if present is None else initial + fed + spawned - removed - deleted - present
        return BottleCounts(initial, fed, removed, rejected, spawned, deleted, held, present)

    @cached_property
    def _initial(self) -> int:
        # Ids are given in ascending order.
        return sum(bottle < self._first_fed for bottle in self._unfed)
