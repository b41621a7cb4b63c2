# SPDX-License-Identifier: Apache-2.0
"""Checks of star wheels against the screws and wheels that feed them: pitch, and bottles per turn."""

from collections.abc import Iterator

from conveyor_sim.scene.phases import rates, star_phases
from conveyor_sim.scene.problems import Problem
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.star_places import wheels_of
from conveyor_sim.scene.types import COORDINATE_LIMIT
from conveyor_sim.scene.words import shown

PITCH_TOLERANCE = 5e-4
"""Largest difference between the pitch of a wheel and that of the bottles that come to it, m. A bottle leaves the
difference in the play of its pocket."""

_RATE_TOLERANCE = 1e-9


def wheel_problems(scene: Scene) -> Iterator[Problem]:
    """Yield problems of wheels too far away, of another pitch than their supply, or that turn at another rate."""
    places = wheels_of(scene.stars)
    for name, wheel in scene.stars.items():
        place = places.get(name)
        if place is None or max(map(abs, place.centre)) + wheel.pitch_radius > COORDINATE_LIMIT:
            yield Problem(
                ("stars", name, "pitch_radius"),
                f"{shown(wheel.pitch_radius)} given, expected a wheel that lies within +-{COORDINATE_LIMIT:.0f} (m)",
            )
    for name, star in star_phases(scene.stars, scene.screws, scene.axes).items():
        supply, part = star.supply, star.wheel.part
        if supply is None:
            continue
        difference = part.pitch - supply.pitch
        if abs(difference) > PITCH_TOLERANCE:
            kind = "last pitch" if supply.field == "screws" else "pitch"
            yield Problem(
                ("stars", name, "pitch_radius"),
                f"{shown(part.pitch_radius)} given, expected the {kind} of {supply.field}.{supply.name}, "
                f"{1e3 * supply.pitch:.6g} mm: 2 pi pitch_radius / pockets is {1e3 * part.pitch:.6g} mm, "
                f"{1e3 * abs(difference):.3g} mm too {'long' if difference > 0.0 else 'short'}",
            )
        both = rates(part, supply, scene.axes)
        if both is not None and abs(both[0] - both[1]) > _RATE_TOLERANCE * abs(both[1]):
            yield Problem(
                ("stars", name, "axis"),
                f"{shown(part.axis)} given, expected an axis that brings as many pockets as "
                f"{supply.field}.{supply.name} brings bottles: {both[0]:.6g} pockets, {both[1]:.6g} bottles per "
                "turn of the common master",
            )
