# SPDX-License-Identifier: Apache-2.0
"""Axes of a scene file: coordinates that drive machines in step, as in motion control (PLCopen).

A cycle of an axis is 2 pi rad. An axis has an own drive (`rate`), or follows a named drive, a machine, or another
axis through an electronic gear.
"""

import math
from collections.abc import Iterator, Mapping
from fractions import Fraction
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal

from annotated_types import Len
from pydantic import SerializerFunctionWrapHandler, model_serializer

from conveyor_sim.scene.parts.device_part import DevicePart, Others, name_problems
from conveyor_sim.scene.parts.machine import PackmlPart
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Angle, Component, Flag, Holds, Limit, Name, Number, Positive, Says, Span, quantity
from conveyor_sim.scene.words import shown

CYCLE = 2.0 * math.pi
"""Cycle of an axis, rad."""

SOURCES = ("rate", "drive", "machine", "master")
"""Fields of which an axis has exactly one."""

_OWNERS = {
    "rate_limit": "rate",
    "travel": "drive",
    "ratio": "master",
    "phase": "master",
    "cam": "master",
    "in_gear": "master",
}
"""Fields that an axis has only with another field."""

_LARGEST_DENOMINATOR = 1000
"""Largest number of teeth in a gear ratio that is recognised as a fraction."""

_ROUNDING = 1e-9

CamPoint = Annotated[tuple[Component, Component], Says("two angles [input, output]")]


class Axis(DevicePart):
    """An axis. It has one of `rate`, `drive`, `machine` and `master`."""

    KIND: ClassVar[str] = "axis"

    rate: Number | None = quantity(
        "Cycles per time at the start, positive forward, of an axis with an own drive.", "1/s", default=None
    )
    rate_limit: Positive | None = quantity(
        "Largest rate that a command may set, forward and backward, with `rate`. Left out: the size of `rate`.",
        "1/s",
        default=None,
    )
    drive: Name | None = quantity("Name of the drive in `drives` that it follows.", default=None)
    travel: Positive | None = quantity("Travel of that drive per cycle; needed with `drive`.", "m", default=None)
    machine: Name | None = quantity(
        "Name of the machine that it follows: one cycle per cycle of the machine. It stands while the machine stands.",
        default=None,
    )
    master: Name | None = quantity("Name of the axis that it follows through a gear.", default=None)
    ratio: Number = quantity("Its speed divided by that of `master`, such as 1/12.", "1", default=1.0)
    phase: Angle = quantity("Its position in gear while `master` is at 0.", "rad", default=0.0)
    cam: (
        Annotated[tuple[CamPoint, ...], Len(0, 1000), Holds("a list of points [input, output] of two angles")] | None
    ) = quantity(
        "Points of a cam with the geared position as input. The first input is 0, the last one ends the table, which "
        "then repeats. Between points the output is piecewise quadratic, with continuous speed. Left out: none.",
        "rad",
        default=None,
    )
    in_gear: Flag = quantity("True: in gear with `master` at the start.", default=True)
    acceleration: Positive = quantity(
        "Acceleration of its drive: at changes of speed out of gear, and when it gears in or shifts its phase.",
        "rad/s^2",
        default=10.0,
    )
    stop_deceleration: Positive | None = quantity(
        "Deceleration out of gear when it is disabled or without power, and when an axis in gear with it has failed. "
        "Left out: `acceleration`.",
        "rad/s^2",
        default=None,
    )
    jog_speed: Positive = quantity(
        "Speed of jogging, and largest additional speed of a phase shift.", "rad/s", default=1.0
    )
    torque_limit: Limit = quantity(
        "Largest torque of its drive. Under a larger load it falls behind.", "N m", default="none"
    )
    inertia: Positive = quantity(
        "Moment of inertia of all that it moves. It has no effect below the torque limit.", "kg m^2", default=1.0
    )
    following_limit: Annotated[Span | Literal["none"], Says('an angle greater than 0, or "none"')] = quantity(
        "Following error at which it fails and stops all axes that are in gear with it.", "rad", default=0.2
    )

    @property
    def top_rate(self) -> float:
        """Largest rate that a command may set, 1/s."""
        return abs(self.rate or 0.0) if self.rate_limit is None else self.rate_limit

    @property
    def gear_spacing(self) -> float:
        """Distance of positions that are in phase, rad: masters of equal angle differ by whole cycles.

        For a ratio p/q in lowest terms, 2 pi / q.
        """
        ratio = Fraction(self.ratio).limit_denominator(_LARGEST_DENOMINATOR)
        return CYCLE / ratio.denominator if abs(float(ratio) - self.ratio) <= _ROUNDING else CYCLE

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of the choice of a source, unknown names, circles of masters, limits, and the cam."""
        given = [field for field in SOURCES if getattr(self, field) is not None]
        if len(given) != 1:
            found = " and ".join(given) or "none"
            yield Problem(path, f"{found} given, expected one of {', '.join(SOURCES)}")
            return
        for field, parts in (("drive", "drives"), ("machine", "machines"), ("master", "axes")):
            yield from name_problems((*path, field), getattr(self, field), parts, others)
        machine = others["machines"].get(self.machine or "")
        if machine is not None and not isinstance(machine, PackmlPart):
            yield Problem((*path, "machine"), f"{shown(self.machine)} given, expected a source, a sink or a station")
        yield from self._foreign(path)
        if self.drive is not None and self.travel is None:
            yield Problem((*path, "travel"), "none given, expected the travel of the drive per cycle (m)")
        if self.rate is not None:
            yield from self._rate_problems(path, self.rate)
        if self.master is not None:
            yield from self._gear_problems(path, others["axes"])
        if self.cam is not None:
            yield from _cam_problems((*path, "cam"), self.cam)
            for field in ("belts", "screws", "side_belts"):
                for name, part in others.get(field, {}).items():
                    if getattr(part, "axis", None) == path[-1]:
                        text = f"given, expected none: {field}.{name} needs an axis without a cam"
                        yield Problem((*path, "cam"), text)
        for field in ("acceleration", "stop_deceleration"):
            value = getattr(self, field)
            if value is None or self.torque_limit == "none" or value * self.inertia <= self.torque_limit:
                continue
            most = self.torque_limit / self.inertia
            yield Problem(
                (*path, field),
                f"{shown(value)} given, expected at most {most:.4g} (rad/s^2), what a torque_limit of "
                f"{self.torque_limit:g} N m gives to its inertia of {self.inertia:g} kg m^2, or torque_limit: none",
            )

    @model_serializer(mode="wrap")
    def _without_foreign_fields(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out the fields that this axis can't have, so that a scene can be read again from its fields."""
        foreign = {field for field, owner in _OWNERS.items() if getattr(self, owner) is None}
        return {name: value for name, value in handler(self).items() if name not in foreign}

    def _foreign(self, path: Path) -> Iterator[Problem]:
        for field, owner in _OWNERS.items():
            if field in self.model_fields_set and getattr(self, owner) is None:
                yield Problem((*path, field), f"{shown(getattr(self, field))} given, expected it only with {owner}")

    def _rate_problems(self, path: Path, rate: float) -> Iterator[Problem]:
        if self.rate_limit is None and rate == 0.0:
            yield Problem(
                (*path, "rate_limit"), "none given with a rate of 0, expected the largest rate of commands (1/s)"
            )
        elif abs(rate) > self.top_rate:
            yield Problem(
                (*path, "rate"), f"{shown(rate)} given, expected at most rate_limit, {self.top_rate:g}, in size (1/s)"
            )

    def _gear_problems(self, path: Path, axes: Mapping[str, "Axis"]) -> Iterator[Problem]:
        if self.ratio == 0.0:
            yield Problem((*path, "ratio"), "0 given, expected another number")
        chain: list[str] = [str(path[-1])]
        master = self.master
        while master is not None and master in axes and master not in chain:
            chain.append(master)
            master = axes[master].master
        if master == chain[0]:
            circle = " -> ".join((*chain, master))
            yield Problem((*path, "master"), f"{shown(self.master)} given, expected no circle: {circle}")
        elif self.master is not None and self.master in axes and axes[self.master].cam is not None:
            yield Problem((*path, "master"), f"{shown(self.master)} given, expected an axis without a cam")


def _cam_problems(path: Path, points: tuple[tuple[float, float], ...]) -> Iterator[Problem]:
    inputs, outputs = [point[0] for point in points], [point[1] for point in points]
    if len(points) < 3:
        yield Problem(path, f"{len(points)} points given, expected three or more")
    elif inputs[0] != 0.0 or any(after <= before for before, after in pairwise(inputs)):
        yield Problem(path, f"inputs {shown(tuple(inputs))} given, expected 0 first, then increasing angles (rad)")
    else:
        turns = (outputs[-1] - outputs[0]) / CYCLE
        if abs(turns - round(turns)) > _ROUNDING:
            yield Problem(
                (*path, len(points) - 1),
                f"{shown(points[-1])} given, expected the output of the first point, or whole turns from it: the table "
                "repeats (rad)",
            )
