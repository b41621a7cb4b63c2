# SPDX-License-Identifier: Apache-2.0
"""Indicators of a scene file: measures of an exit."""

from collections.abc import Iterator
from typing import ClassVar

from conveyor_sim.scene.parts.device_part import DevicePart, Others, name_problems
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Name, Positive, quantity
from conveyor_sim.scene.words import shown


class Indicator(DevicePart):
    """Flow, jam, starved and blocked of one exit: a place that bottles leave on a belt."""

    KIND: ClassVar[str] = "indicator"

    counter: Name = quantity("Counter over which bottles leave, forward.")
    belt: Name = quantity("Belt that brings them there.")
    zone: Name = quantity("Zone before the exit, in which bottles wait.")
    jam_time: Positive = quantity(
        "`jam`: no bottle passed for this time, although the belt ran, bottles waited and the exit was not blocked.",
        "s",
    )
    starved_time: Positive | None = quantity(
        "`starved`: the belt has run for this time and no bottle waited. Left out: the jam_time.", "s", default=None
    )
    window: Positive = quantity("Averaging time of `flow`.", "s", default=60.0)
    downstream: Name | None = quantity(
        "Belt after the exit. `blocked`: this belt stands, while bottles wait and `belt` runs or should run.",
        default=None,
    )
    backup: Name | None = quantity(
        "Zone behind the exit, with full_at. `blocked`: it is full, while bottles wait and `belt` runs or should run.",
        default=None,
    )

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of unknown names, and of names that do not fit together."""
        for field, value, section in (
            ("counter", self.counter, "counters"),
            ("belt", self.belt, "belts"),
            ("zone", self.zone, "zones"),
            ("downstream", self.downstream, "belts"),
            ("backup", self.backup, "zones"),
        ):
            yield from name_problems((*path, field), value, section, others)
        if self.downstream == self.belt:
            text = f"{shown(self.downstream)} given, expected another belt than `belt`"
            yield Problem((*path, "downstream"), text)
        backup = others["zones"].get(self.backup) if self.backup is not None else None
        if backup is not None and backup.full_at is None:
            yield Problem((*path, "backup"), f"{shown(self.backup)} given, expected a zone that has full_at")
