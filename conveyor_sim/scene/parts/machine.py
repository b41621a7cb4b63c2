# SPDX-License-Identifier: Apache-2.0
"""Fields of machines that follow the PackML state model."""

from collections.abc import Iterator
from typing import Annotated

from annotated_types import Len

from conveyor_sim.scene.failures import Failure, PlannedStop
from conveyor_sim.scene.part import Part
from conveyor_sim.scene.parts.device_part import DevicePart, Exit, Others, name_problems
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Count, Holds, Name, NotNegative, PolygonList, Positive, quantity
from conveyor_sim.scene.words import shown

MOST_STOPS = 100
"""Largest number of failures and of planned stops of one machine. Each is a number of its stop reason."""


class ActingTimes(Part):
    """Durations of the acting states of PackML; 0: the state is passed at once."""

    clearing: NotNegative = quantity("From Aborted to Stopped.", "s", default=0.0)
    starting: NotNegative = quantity("From Idle to Execute.", "s", default=0.0)
    stopping: NotNegative = quantity("To Stopped.", "s", default=0.0)
    aborting: NotNegative = quantity("To Aborted.", "s", default=0.0)
    holding: NotNegative = quantity("To Held.", "s", default=0.0)
    unholding: NotNegative = quantity("From Held to Execute.", "s", default=0.0)
    suspending: NotNegative = quantity("To Suspended.", "s", default=0.0)
    unsuspending: NotNegative = quantity("From Suspended to Execute.", "s", default=0.0)
    resetting: NotNegative = quantity("From Stopped or Complete to Idle.", "s", default=0.0)
    completing: NotNegative = quantity("To Complete, at least.", "s", default=0.0)


class PackmlPart(DevicePart):
    """A machine that follows the PackML state model. It is in Execute at the start."""

    rate: Positive = quantity("Bottles a second at the start.", "1/s")
    rate_limit: Positive | None = quantity(
        "Greatest rate that a command may ask for. Left out: `rate`.", "1/s", default=None
    )
    ramp_up: NotNegative = quantity(
        "Time from standstill to `rate` after each entry into Execute, at an even slope; it stops at once.",
        "s",
        default=0.0,
    )
    suspend_after: NotNegative = quantity(
        "Starved or blocked for this time without a break, it goes to Suspended, and back as soon as it can work.",
        "s",
        default=2.0,
    )
    acting_times: ActingTimes = quantity(
        "How long it takes from state to state.", default=ActingTimes.model_construct()
    )
    failures: Annotated[
        dict[Name, Failure], Len(0, MOST_STOPS), Holds(f"a mapping of at most {MOST_STOPS} names to failures")
    ] = quantity("How it fails, drawn from the seed: it goes to Held, and back once it is repaired.", default={})
    planned_stops: Annotated[
        dict[Name, PlannedStop], Len(0, MOST_STOPS), Holds(f"a mapping of at most {MOST_STOPS} names to planned stops")
    ] = quantity("When it is stopped by plan.", default={})

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield further problems, a rate beyond its limit, and overlapping planned stops."""
        yield from super().problems(path, others)
        if self.rate_limit is not None and self.rate_limit < self.rate:
            text = f"{shown(self.rate_limit)} given, expected at least {self.rate:g} (1/s), the rate"
            yield Problem((*path, "rate_limit"), text)
        for name, stop in self.planned_stops.items():
            yield from stop.problems((*path, "planned_stops", name))


class TakingPart(PackmlPart, Exit):
    """A machine that takes bottles out of a region, in the order of their arrival."""

    region: PolygonList = quantity("Where it takes bottles, in the order of their arrival: a simple polygon.", "m")
    start_fill: Count | None = quantity(
        "It starts, and resumes after it was starved, when this many bottles wait; the run begins in Starting then. "
        "Left out: one will do.",
        "1",
        default=None,
    )
    start_zone: Name | None = quantity(
        "Zone that `start_fill` counts, with its offset. Left out: the machine's own `region`.", default=None
    )
    run_down: NotNegative = quantity(
        "Emptying, by the command Complete: it works until no bottle has come for this time, then it is Complete.",
        "s",
        default=5.0,
    )

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield further problems, and an unknown or unused zone."""
        yield from super().problems(path, others)
        yield from name_problems((*path, "start_zone"), self.start_zone, "zones", others)
        if self.start_zone is not None and self.start_fill is None:
            yield Problem((*path, "start_zone"), f"{shown(self.start_zone)} given, expected start_fill beside it")
