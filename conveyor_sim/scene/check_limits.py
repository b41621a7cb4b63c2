"""Checks of limits: each needs something that it can limit."""

from collections.abc import Iterator

from conveyor_sim.scene.problems import Problem
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.words import shown


def limit_problems(scene: Scene) -> Iterator[Problem]:
    """Yield problems of single heights of bottle types, and of limits of absent quantities."""
    tips = False
    for name, kind in scene.bottle_types.items():
        given = {"contact_height": kind.contact_height, "gravity_height": kind.gravity_height}
        missing = [field for field, value in given.items() if value is None]
        tips = tips or not missing
        if len(missing) == 1:
            other = next(field for field in given if field not in missing)
            text = f"{shown(given[other])} given without {missing[0]}, expected both or neither"
            yield Problem(("bottle_types", name, other), text)
    limits = scene.limits
    if limits.tipping is not None and not tips:
        text = f"{shown(limits.tipping)} given, expected a bottle type with contact_height and gravity_height"
        yield Problem(("limits", "tipping"), text)
    if limits.clogging_time is not None and not scene.outfeeds:
        text = f"{shown(limits.clogging_time)} given, expected an outfeed that could clog"
        yield Problem(("limits", "clogging_time"), text)
