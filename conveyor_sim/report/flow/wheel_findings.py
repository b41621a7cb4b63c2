# SPDX-License-Identifier: Apache-2.0
"""Findings about star wheels: a phase at which pockets miss the bottles that come to them."""

from __future__ import annotations

from collections.abc import Iterator

from conveyor_sim.report.flow.finding import Finding, in_mm
from conveyor_sim.scene.phases import star_phases
from conveyor_sim.scene.schema import Scene

LEAST_ERROR = 1e-3
"""Distance between a bottle and its pocket that is within the play of common pockets, m."""


def wrong_phases(scene: Scene) -> Iterator[Finding]:
    """Yield a finding for each wheel whose pockets come too early or too late for the bottles of its supply."""
    for name, star in star_phases(scene.stars, scene.screws, scene.axes).items():
        if star.fitting is None or star.supply is None or abs(star.error) <= LEAST_ERROR:
            continue
        when = "early" if star.error > 0.0 else "late"
        text = (
            f"its pockets are {in_mm(abs(star.error))} too {when} for the bottles of {star.supply.field}."
            f"{star.supply.name}: a phase of {star.fitting:.6g} rad fits"
        )
        yield Finding(("stars", name, "phase"), text)
