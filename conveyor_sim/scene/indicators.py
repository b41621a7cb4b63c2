"""Indicators of a scene file: what a line engineer wants to know of an exit."""

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.types import Name, Positive, quantity


class Indicator(Part):
    """Flow, jam, starved and blocked of one exit: a place that bottles leave on a belt."""

    counter: Name = quantity("Counter over which bottles leave, forward.")
    belt: Name = quantity("Belt that brings them there.")
    zone: Name = quantity("Zone before the exit: what is in it waits to leave.")
    jam_time: Positive = quantity(
        "`jam`: nothing has passed for so long although the belt ran, bottles waited and it was not blocked.", "s"
    )
    starved_time: Positive | None = quantity(
        "`starved`: the belt has run for so long and no bottle waited. Left out: the jam_time.", "s", default=None
    )
    window: Positive = quantity("`flow` is over the last so many seconds.", "s", default=60.0)
    downstream: Name | None = quantity(
        "Belt that takes the bottles on. `blocked`: it stands, while bottles wait and `belt` runs or is told to.",
        default=None,
    )
    backup: Name | None = quantity(
        "Zone behind the exit, with full_at. `blocked`: it is full, while bottles wait and `belt` runs or is told to.",
        default=None,
    )
