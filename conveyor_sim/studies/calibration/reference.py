# SPDX-License-Identifier: Apache-2.0
"""Tables of docs/calibration.md: kinds of measurements and columns."""

from __future__ import annotations

from collections.abc import Mapping

from conveyor_sim.studies.calibration.quantities import COLUMNS, KINDS, OPTIONAL_TEXTS, TEXT_COLUMNS


def tables() -> Mapping[str, Mapping[str, str]]:
    """Return the tables by page and name."""
    kinds = ["| `quantity` | measurement | columns of numbers | determines |", "|---|---|---|---|"]
    for name, kind in KINDS.items():
        needed = ", ".join(f"`{column}`" for column in kind.columns)
        kinds.append(f"| `{name}` | {kind.meaning} | {needed} | {kind.enters} |")
    columns = ["| column | unit such as | meaning |", "|---|---|---|"]
    for name, meaning in TEXT_COLUMNS.items():
        columns.append(f"| `{name}` | text | {meaning}{' May be left out.' if name in OPTIONAL_TEXTS else ''} |")
    columns += [f"| `{name}` | {column.usual} | {column.meaning} |" for name, column in COLUMNS.items()]
    return {"calibration": {"kinds": "\n".join(kinds), "columns": "\n".join(columns)}}
