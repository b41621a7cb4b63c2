# SPDX-License-Identifier: Apache-2.0
"""Routes: legs from an entry through stations to an exit, joined."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from conveyor_sim.report.flow.trace import Leg
from conveyor_sim.scene.parts.station import Station
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.schema import Scene


@dataclass(frozen=True)
class TransitRoute:
    """Way of bottles from an entry to its end."""

    legs: tuple[Leg, ...]
    cycles: float
    """s in stations."""

    @property
    def entry(self) -> Path:
        """Path of the entry."""
        return self.legs[0].start.path

    @property
    def stops(self) -> tuple[Path, ...]:
        """Paths of entry, stations and exit, in order."""
        return (self.entry, *(leg.exit for leg in self.legs if leg.exit is not None))

    @property
    def last(self) -> Leg:
        """Last leg."""
        return self.legs[-1]

    @property
    def seconds(self) -> float:
        """Transit time of a lone bottle, s."""
        return sum(leg.seconds for leg in self.legs) + self.cycles

    @property
    def traced(self) -> float | None:
        """Way in m after which a leg is estimated by the speeds of the belts; None if all are traced."""
        return next((leg.traced for leg in self.legs if leg.traced is not None), None)

    @property
    def length(self) -> float:
        """Way on the line, m."""
        return sum(leg.length for leg in self.legs)


def routes_of(scene: Scene, legs: Sequence[Leg]) -> tuple[TransitRoute, ...]:
    """Return a route from each entry, and from each station that no other route passes."""
    by_start = {leg.start.path: leg for leg in legs}
    routes: list[TransitRoute] = []
    passed: set[Path] = set()
    ordered = sorted(legs, key=lambda leg: leg.start.returned)
    for leg in ordered:
        if leg.start.path in passed:
            continue
        chain = [leg]
        while chain[-1].end == "station" and (following := by_start.get(chain[-1].exit or ())) is not None:
            if following in chain:
                break
            chain.append(following)
        passed.update(one.start.path for one in chain[1:])
        parts = [scene.machines[str(one.start.path[1])] for one in chain[1:]]
        inside = sum(part.holding_time for part in parts if isinstance(part, Station))
        routes.append(TransitRoute(tuple(chain), inside))
    return tuple(routes)
