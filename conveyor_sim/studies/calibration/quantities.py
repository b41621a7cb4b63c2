# SPDX-License-Identifier: Apache-2.0
"""Kinds of measurements and their columns in a CSV file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

TEXT_COLUMNS: Mapping[str, str] = {
    "quantity": "Kind of the measurement.",
    "material": "Material of the bottle, as named in the scene; empty for vibration.",
    "other": "Material that it touches: of the chain, of a rail, or of the other bottle.",
    "sample": "Bottle or specimen, any text. Rows of one sample are repetitions; left out: each row is a sample.",
    "note": "Any text; not read.",
}
"""Columns of texts and their meanings. `sample` and `note` may be left out."""
OPTIONAL_TEXTS = ("sample", "note")


@dataclass(frozen=True)
class NumberColumn:
    """A column of numbers. Its header has the unit in brackets: `force (N)`."""

    unit: str
    """SI unit of the values in `Measurement`."""
    usual: str
    """Unit that instruments show, for examples and errors."""
    meaning: str
    low: float
    """Smallest value, SI. Values beyond the range come from a wrong unit, or can't be measured."""
    high: float
    """Largest value, SI."""


COLUMNS: Mapping[str, NumberColumn] = {
    "force": NumberColumn("N", "N", "Reading of the scale or the load cell.", 0.0, 1e6),
    "mass": NumberColumn("kg", "g", "Mass of all bottles that are held, contents included.", 1e-4, 1e3),
    "normal_force": NumberColumn("N", "N", "Force that presses the surfaces together.", 1e-4, 1e6),
    "speed": NumberColumn("m/s", "mm/s", "Speed of the chain below the bottle that is held.", 1e-6, 10.0),
    "drop_height": NumberColumn("m", "mm", "Clear height between bottle and plate before the drop.", 1e-4, 100.0),
    "rebound_height": NumberColumn("m", "mm", "Clear height at the top of the first rebound.", 1e-6, 100.0),
    "length": NumberColumn(
        "m", "mm", "Length of the pendulum, from the suspension to the axis of the bottle.", 1e-2, 100.0
    ),
    "angle_before": NumberColumn(
        "rad", "deg", "Angle to the vertical at which the bottle is released.", math.radians(0.1), math.pi
    ),
    "angle_after": NumberColumn(
        "rad",
        "deg",
        "Largest angle of the same bottle after the impact, positive where it rebounds; negative if a bottle that "
        "hits another one follows it.",
        -math.pi,
        math.pi,
    ),
    "angle_struck": NumberColumn("rad", "deg", "Largest angle of the bottle that was hit at rest.", 0.0, math.pi),
    "overlap": NumberColumn("m", "mm", "Approach of the two bodies beyond first touch.", -0.1, 0.1),
    "acceleration": NumberColumn(
        "m/s^2", "m/s^2", "Amplitude of the acceleration at the peak of the spectrum.", 1e-6, 1e4
    ),
    "frequency": NumberColumn("Hz", "Hz", "Frequency of the peak.", 0.01, 1e5),
    "direction": NumberColumn(
        "rad",
        "deg",
        "Axis of the vibration, counter-clockwise from the direction of travel.",
        -2.0 * math.pi,
        2.0 * math.pi,
    ),
}
"""Columns of numbers by name."""


@dataclass(frozen=True)
class Kind:
    """A value of the column `quantity`."""

    columns: tuple[str, ...]
    """Columns of numbers that a row needs; all others are empty."""
    meaning: str
    enters: str
    """Field of the scene that the measurement determines."""
    has_bottle: bool = True
    """True if the row names the material of a bottle."""


KINDS: Mapping[str, Kind] = {
    "base_friction": Kind(
        ("force", "mass"),
        "A bottle is held by a pull scale while the chain runs below it.",
        "`friction` in `base`",
    ),
    "contact_friction": Kind(
        ("force", "normal_force"),
        "A bottle that can't turn is pulled along a rail or another bottle that it is pressed against.",
        "`friction` in `contacts`",
    ),
    "slip_limit": Kind(
        ("force", "mass", "speed"),
        "As base_friction, at several speeds of the chain, from creep to normal.",
        "`slip_limit`; `friction` in `base` if there is no base_friction",
    ),
    "drop": Kind(
        ("drop_height", "rebound_height"),
        "A bottle falls on its side onto a heavy plate.",
        "`damping` in `contacts`",
    ),
    "pendulum": Kind(
        ("length", "angle_before", "angle_after"),
        "A hanging bottle swings against a fixed rail.",
        "`damping` in `contacts`",
    ),
    "pendulum_pair": Kind(
        ("length", "angle_before", "angle_after", "angle_struck"),
        "A hanging bottle swings against an equal one that hangs at rest.",
        "`damping` in `contacts`",
    ),
    "compression": Kind(
        ("overlap", "force"),
        "A bottle is pressed against a rail or a bottle, by a testing machine or in a finite element analysis.",
        "`stiffness`, `hertz_stiffness` or `table` in `contacts`",
    ),
    "vibration": Kind(
        ("acceleration", "frequency", "direction"),
        "An accelerometer lies on the running chain.",
        "`vibration` of a belt or conveyor",
        has_bottle=False,
    ),
}
"""Kinds of measurements by their name in the column `quantity`."""
