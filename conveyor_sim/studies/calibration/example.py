# SPDX-License-Identifier: Apache-2.0
"""Example of a file of measurements, with its columns in comments. The values are invented."""

from __future__ import annotations

from conveyor_sim.studies.calibration.quantities import COLUMNS, KINDS, OPTIONAL_TEXTS, TEXT_COLUMNS

_ROWS = """\
base_friction,glass,chain,1,0.52,350
base_friction,glass,chain,2,0.55,352
base_friction,glass,chain,3,0.49,349
base_friction,glass,chain,4,0.53,351
slip_limit,glass,chain,1,0.14,350,,1
slip_limit,glass,chain,1,0.26,350,,2
slip_limit,glass,chain,1,0.45,350,,5
slip_limit,glass,chain,1,0.52,350,,10
slip_limit,glass,chain,1,0.51,350,,50
contact_friction,glass,steel,1,1.52,,,,10
contact_friction,glass,steel,2,1.61,,,,10
contact_friction,glass,steel,3,1.44,,,,10
drop,glass,steel,1,,,,,,100,61
drop,glass,steel,2,,,,,,100,58
drop,glass,steel,3,,,,,,100,64
pendulum_pair,glass,glass,1,,,,,,,,500,30,-3.4,26.1
pendulum_pair,glass,glass,2,,,,,,,,500,30,-4.1,25.7
pendulum_pair,glass,glass,3,,,,,,,,500,30,-3.1,26.8
compression,glass,steel,,0,,0.000
compression,glass,steel,,98,,0.010
compression,glass,steel,,205,,0.020
compression,glass,steel,,301,,0.030
compression,glass,steel,,398,,0.040
compression,glass,glass,,0,,0.000
compression,glass,glass,,31,,0.010
compression,glass,glass,,90,,0.020
compression,glass,glass,,163,,0.030
compression,glass,glass,,254,,0.040
vibration,,chain,,,,,,,,,,,,,1.9,24.8,3
vibration,,chain,,,,,,,,,,,,,2.2,25.3,-2
vibration,,chain,,,,,,,,,,,,,2.0,25.1,1
"""
_ORDER = (
    "force", "mass", "overlap", "speed", "normal_force", "drop_height", "rebound_height", "length", "angle_before",
    "angle_after", "angle_struck", "acceleration", "frequency", "direction",
)  # fmt: skip
"""Columns of numbers of the example, those of most rows first."""


def example() -> str:
    """Return the text of the file."""
    names = ["quantity", "material", "other", "sample", *(f"{name} ({COLUMNS[name].usual})" for name in _ORDER)]
    rows = [row.split(",") for row in _ROWS.splitlines()]
    cells = [",".join([*row, *[""] * (len(names) - len(row))]) for row in rows]
    return "\n".join([*_comments(), ",".join(names), *cells]) + "\n"


def _comments() -> list[str]:
    lines = [
        "# Measurements for conveyor-sim calibrate. One row per measurement; lines that begin with # are not read.",
        "# The unit of a column stands in its header and can be changed: mm, cm, g, kg, N, kN, rad, ...",
        "# Columns of texts:",
    ]
    for name, meaning in TEXT_COLUMNS.items():
        lines.append(f"#   {name}: {meaning}{' May be left out.' if name in OPTIONAL_TEXTS else ''}")
    lines.append("# Values of quantity, with the columns that each needs:")
    lines += [f"#   {name}: {', '.join(kind.columns)}. {kind.meaning}" for name, kind in KINDS.items()]
    lines.append("# Columns of numbers:")
    lines += [f"#   {name}: {COLUMNS[name].meaning}" for name in _ORDER]
    return lines
