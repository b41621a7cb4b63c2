# SPDX-License-Identifier: Apache-2.0
"""Rails of a scene file that move on command: gates, pushers, diverters, dividers, guides, clamps. All are straight.

Their drives are treated as pneumatic cylinders at 6 bar, of the bores of ISO 6432: 20 mm at gates that slide, 25 mm at
pushers, and 25 mm at a crank of 50 mm where rails swing. A bore of 20 mm is that of common stop cylinders for single
bottles. Pushers and diverters are one size larger.
"""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from annotated_types import Len
from pydantic import Tag

from conveyor_sim.scene.part import one_of
from conveyor_sim.scene.parts.device_part import DevicePart, Others, line_problems, name_problems
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import (
    XY,
    Angle,
    Flag,
    Holds,
    Index,
    Limit,
    Name,
    NotNegative,
    Number,
    Point,
    Positive,
    quantity,
)
from conveyor_sim.scene.words import shown

PRESSURE = 6e5
"""Gauge pressure of compressed air in a plant, Pa."""


def cylinder_force(bore: float) -> float:
    """Return the force (N) of a cylinder by bore (m), without friction, to a tenth: pi/4 bore^2 times PRESSURE."""
    return round(0.25 * math.pi * bore**2 * PRESSURE, 1)


GATE_FORCE, PUSHER_FORCE = cylinder_force(0.020), cylinder_force(0.025)
"""188.5 N, 294.5 N."""

CLAMP_FORCE = cylinder_force(0.010)
"""47.1 N."""

MOST_POSITIONS = 50
_POSITIONS = f"2 to {MOST_POSITIONS}"

LEAST_STROKE = 1e-6
"""Least stroke between two positions, m or rad."""

CRANK_TORQUE = round(0.05 * PUSHER_FORCE, 1)
"""14.7 N m."""


class _Mover(DevicePart):
    if TYPE_CHECKING:
        from_: XY
        to: XY
        acceleration: float

    DRIVE: ClassVar[tuple[str, str, str, str, str]]
    """Names and units: limit of the drive, its unit, mass, its unit, unit of the acceleration."""

    material: Name = quantity("Material, as named in `contacts`.")

    @property
    def drive_limit(self) -> float | None:
        """Largest force or torque of its drive, N or N m; None without limit."""
        limit = getattr(self, self.DRIVE[0])
        return None if limit == "none" else float(limit)

    @property
    def drive_mass(self) -> float:
        """Moving mass, kg, or kg m^2 about its start."""
        raise NotImplementedError

    def shape_problems(self, path: Path) -> Iterator[Problem]:
        """Yield problems of the geometry."""
        yield from line_problems(path, self.from_, self.to)

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of the geometry, and of a drive that is too weak for its acceleration."""
        wrong = list(self.shape_problems(path))
        yield from wrong
        force = self.drive_limit
        if wrong or force is None or self.acceleration * self.drive_mass <= force:
            return
        limit, force_unit, mass, mass_unit, unit = self.DRIVE
        yield Problem(
            (*path, "acceleration"),
            f"{shown(self.acceleration)} given, expected at most {force / self.drive_mass:.4g} ({unit}), what a "
            f"{limit} of {force:g} {force_unit} gives to its {mass} of {self.drive_mass:.4g} {mass_unit}, "
            f"or {limit}: none",
        )


class _Linear(_Mover):
    DRIVE = ("force_limit", "N", "moving_mass", "kg", "m/s^2")

    max_speed: Positive = quantity("Its greatest speed.", "m/s")
    acceleration: Positive = quantity("Acceleration at starts, reversals and stops.", "m/s^2")
    force_limit: Limit = quantity(
        "Largest force of the drive. A larger load stops the rail, or moves it back. Default: a cylinder of 20 mm "
        "bore at 6 bar (ISO 6432).",
        "N",
        default=GATE_FORCE,
    )
    moving_mass: Positive = quantity(
        "Moving mass: rail, carriage and piston rod. It has no effect below the force limit.", "kg", default=1.0
    )

    @property
    def drive_mass(self) -> float:
        """Moving mass, kg."""
        return self.moving_mass


class _Sliding(_Linear):
    direction: Angle = quantity("Direction in which it slides, from the x-axis, counter-clockwise.", "rad")


class _SlidingStroke(_Sliding):
    stroke: Positive = quantity("Stroke length.", "m")


class _Swinging(_Mover):
    DRIVE = ("torque_limit", "N m", "inertia", "kg m^2", "rad/s^2")

    max_speed: Positive = quantity("Its greatest angular speed.", "rad/s")
    acceleration: Positive = quantity("Angular acceleration at starts, reversals and stops.", "rad/s^2")
    torque_limit: Limit = quantity(
        "Largest torque of the drive. A larger load stops the rail, or moves it back. Default: a cylinder of 25 "
        "mm bore at 6 bar (ISO 6432) at a crank of 50 mm.",
        "N m",
        default=CRANK_TORQUE,
    )
    inertia: Positive | None = quantity(
        "Moment of inertia about `from` of the moving parts. It has no effect below the torque limit. Left out: "
        "that of a rod of 1 kg, length^2 / 3.",
        "kg m^2",
        default=None,
    )

    @property
    def drive_mass(self) -> float:
        """Moment of inertia, kg m^2."""
        return math.dist(self.from_, self.to) ** 2 / 3.0 if self.inertia is None else self.inertia


class _SwingingStroke(_Swinging):
    angle: Angle = quantity("Angle through which it swings about `from`, counter-clockwise if positive.", "rad")

    def shape_problems(self, path: Path) -> Iterator[Problem]:
        """Yield problems of coinciding ends and invalid angles."""
        yield from super().shape_problems(path)
        if not 1e-6 <= abs(self.angle) <= 2.0 * math.pi:
            yield Problem(
                (*path, "angle"),
                f"{shown(self.angle)} given, expected an angle of 1e-6 rad up to a full turn, to either side",
            )


class SlidingGate(_SlidingStroke):
    """A gate or a stop that slides open."""

    KIND: ClassVar[str] = "gate"

    kind: Literal["slide"] = quantity("The kind of gate.")
    from_: Point = quantity("One end while it is closed.", "m", alias="from")
    to: Point = quantity("The other end while it is closed.", "m")
    open: Flag = quantity("True: open at the start.", default=False)


class SwingingGate(_SwingingStroke):
    """A gate or a stop that swings open about its first end."""

    KIND: ClassVar[str] = "gate"

    kind: Literal["swing"] = quantity("The kind of gate.")
    from_: Point = quantity("The end about which it swings.", "m", alias="from")
    to: Point = quantity("The other end while it is closed.", "m")
    open: Flag = quantity("True: open at the start.", default=False)


class LiftingGate(_Linear):
    """A gate or a stop that lifts open. Bottles pass under it when it is above half of its stroke.

    If a bottle is below when it lowers, it stays above the bottle, and is blocked.
    """

    KIND: ClassVar[str] = "gate"

    kind: Literal["lift"] = quantity("The kind of gate.")
    from_: Point = quantity("One end.", "m", alias="from")
    to: Point = quantity("The other end.", "m")
    stroke: Positive = quantity("Height through which it lifts.", "m", default=0.1)
    open: Flag = quantity("True: open at the start.", default=False)


class Clamp(_SlidingStroke):
    """Two parallel jaws that close on bottles, as those of a gripper do. One drive moves both."""

    KIND: ClassVar[str] = "clamp"

    from_: Point = quantity("One end of the first jaw while it is open.", "m", alias="from")
    to: Point = quantity("The other end of the first jaw while it is open.", "m")
    stroke: Positive = quantity("Stroke length of each jaw along `direction`, which leads to the other jaw.", "m")
    opening: Positive = quantity("Distance of the jaws along `direction` while they are open.", "m")
    force_limit: Limit = quantity(
        "Largest force of the drive. Each jaw presses with half of it. Default: a cylinder of 10 mm bore at 6 bar (ISO "
        "6432).",
        "N",
        default=CLAMP_FORCE,
    )

    def shape_problems(self, path: Path) -> Iterator[Problem]:
        """Yield problems of coinciding ends, and of jaws that meet."""
        yield from super().shape_problems(path)
        if 2.0 * self.stroke >= self.opening:
            yield Problem(
                (*path, "stroke"),
                f"{shown(self.stroke)} given, expected less than half of opening, {self.opening:g} (m)",
            )


class Pusher(_SlidingStroke):
    """A straight rail that moves along a direction and returns."""

    KIND: ClassVar[str] = "pusher"

    from_: Point = quantity("One end while it is retracted.", "m", alias="from")
    to: Point = quantity("The other end while it is retracted.", "m")
    force_limit: Limit = quantity(
        "Largest force of the drive. A larger load stops the rail, or moves it back. Default: a cylinder of 25 mm "
        "bore at 6 bar (ISO 6432).",
        "N",
        default=PUSHER_FORCE,
    )
    zone: Name | None = quantity(
        "Zone with `full_at` that holds a complete row or layer. The pusher pushes by itself when the zone is full, "
        "and returns from the end of its stroke. Left out: it pushes on command only.",
        default=None,
    )
    settle: NotNegative = quantity("Time for which the zone must be full before it pushes.", "s", default=0.0)

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of its shape and drive, and of a zone that is unknown or never full."""
        yield from super().problems(path, others)
        yield from name_problems((*path, "zone"), self.zone, "zones", others)
        if self.zone is None and self.settle:
            yield Problem((*path, "settle"), f"{shown(self.settle)} given, expected zone beside it")
        if self.zone is not None and self.zone in others["zones"] and others["zones"][self.zone].full_at is None:
            yield Problem((*path, "zone"), f"{shown(self.zone)} given, expected a zone with full_at")


class Diverter(_SwingingStroke):
    """A straight rail that swings about its first end into the path of bottles and returns."""

    KIND: ClassVar[str] = "diverter"

    from_: Point = quantity("The pivot.", "m", alias="from")
    to: Point = quantity("The other end while it does not divert.", "m")


class _Positioned(_Mover):
    positions: tuple[float, ...]

    @property
    def index(self) -> int:
        """Index of its initial position."""
        raise NotImplementedError

    def shape_problems(self, path: Path) -> Iterator[Problem]:
        """Yield problems of coinciding ends, of positions that are all the same, and of an index beyond them."""
        yield from super().shape_problems(path)
        if max(self.positions) - min(self.positions) < LEAST_STROKE:
            yield Problem((*path, "positions"), f"{shown(self.positions)} given, expected different positions")

    def index_problems(self, path: Path, field: str) -> Iterator[Problem]:
        """Yield a problem of an initial index beyond the positions."""
        if self.index >= len(self.positions):
            last = len(self.positions) - 1
            yield Problem((*path, field), f"{self.index} given, expected at most {last}, the last of positions")


class _Divider(_Positioned):
    KIND: ClassVar[str] = "divider"

    lane: Index = quantity("Lane that it feeds at the start.", "1", default=0)
    clearance: Positive | None = quantity(
        "Clear width between two parallel rails, half of it on either side of the line from `from` to `to`, between "
        "which bottles pass. Left out: one rail.",
        "m",
        default=None,
    )

    @property
    def index(self) -> int:
        """Index of its initial position."""
        return self.lane

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of its shape and drive, and of an unknown lane."""
        yield from super().problems(path, others)
        yield from self.index_problems(path, "lane")


class SwingingDivider(_Divider, _Swinging):
    """A rail that swings about its first end, and stands at one of several angles: one for each lane that it feeds."""

    kind: Literal["swing"] = quantity("The kind of divider.")
    from_: Point = quantity("The pivot.", "m", alias="from")
    to: Point = quantity("The other end at an angle of 0.", "m")
    positions: Annotated[tuple[Angle, ...], Len(2, MOST_POSITIONS), Holds(f"a list of {_POSITIONS} angles")] = quantity(
        "Its angle for each lane, from lane 0 on, counter-clockwise.", "rad"
    )

    def shape_problems(self, path: Path) -> Iterator[Problem]:
        """Yield problems of its shape, and of angles that are more than a turn apart."""
        yield from super().shape_problems(path)
        if max(self.positions) - min(self.positions) > 2.0 * math.pi:
            yield Problem((*path, "positions"), f"{shown(self.positions)} given, expected angles within a full turn")


class SlidingDivider(_Divider, _Sliding):
    """A rail that slides across, and stands at one of several places: one for each lane that it feeds."""

    kind: Literal["slide"] = quantity("The kind of divider.")
    from_: Point = quantity("One end at a position of 0.", "m", alias="from")
    to: Point = quantity("The other end at a position of 0.", "m")
    positions: Annotated[tuple[Number, ...], Len(2, MOST_POSITIONS), Holds(f"a list of {_POSITIONS} numbers")] = (
        quantity("Its displacement along `direction` for each lane, from lane 0 on.", "m")
    )


class AdjustableGuide(_Positioned, _Sliding):
    """A straight guide that a drive sets to one of several positions, such as one for each format."""

    KIND: ClassVar[str] = "adjustable"

    from_: Point = quantity("One end at a position of 0.", "m", alias="from")
    to: Point = quantity("The other end at a position of 0.", "m")
    positions: Annotated[tuple[Number, ...], Len(2, MOST_POSITIONS), Holds(f"a list of {_POSITIONS} numbers")] = (
        quantity("Its settings: displacements along `direction`.", "m")
    )
    setting: Index = quantity("Number of its setting at the start, from 0. A format can change it.", "1", default=0)

    @property
    def index(self) -> int:
        """Index of its initial position."""
        return self.setting

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of its shape and drive, and of an unknown setting."""
        yield from super().problems(path, others)
        yield from self.index_problems(path, "setting")


Divider = Annotated[
    Annotated[SwingingDivider, Tag("(swing)")] | Annotated[SlidingDivider, Tag("(slide)")],
    one_of({"swing": "(swing)", "slide": "(slide)"}),
]
"""Kinds of divider."""

Gate = Annotated[
    Annotated[SlidingGate, Tag("(slide)")]
    | Annotated[SwingingGate, Tag("(swing)")]
    | Annotated[LiftingGate, Tag("(lift)")],
    one_of({"slide": "(slide)", "swing": "(swing)", "lift": "(lift)"}),
]
"""Kinds of gate."""

Positioned = SwingingDivider | SlidingDivider | AdjustableGuide
"""Movers with several positions."""

Mover = SlidingGate | SwingingGate | LiftingGate | Clamp | Pusher | Diverter | Positioned
