# SPDX-License-Identifier: Apache-2.0
"""Measurements as rows of one CSV file per part, and queries for tables."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from statistics import median


@dataclass(frozen=True)
class Row:
    """One number."""

    case: str
    """Name of the table and of the varied quantity."""
    n: float
    """Bottles, or whatever is varied."""
    contestant: str
    quantity: str
    """With its unit."""
    round: int
    """Numbers of one round were measured one right after the other."""
    value: float


@dataclass(frozen=True)
class Spread:
    """Some numbers of one kind."""

    middle: float
    least: float
    greatest: float

    def __str__(self) -> str:
        return f"{self.middle:.3g} ({self.least:.3g} to {self.greatest:.3g})"


class Rows:
    """Rows of one part."""

    def __init__(self, rows: Iterable[Row] = ()) -> None:
        self.all = list(rows)

    def values(self, case: str, n: float, contestant: str, quantity: str) -> dict[int, float]:
        """By round; empty if there are none."""
        wanted = (case, n, contestant, quantity)
        return {row.round: row.value for row in self.all if (row.case, row.n, row.contestant, row.quantity) == wanted}

    def spread(self, case: str, n: float, contestant: str, quantity: str) -> Spread | None:
        """Median, least and greatest; None if it wasn't measured."""
        return spread_of(self.values(case, n, contestant, quantity).values())

    def ratio(self, case: str, n: float, one: str, other: str, quantity: str) -> Spread | None:
        """Return the ratio of two contestants, taken round by round; None if either wasn't measured."""
        above, below = (self.values(case, n, contestant, quantity) for contestant in (one, other))
        return spread_of(above[i] / below[i] for i in sorted(above.keys() & below.keys()))

    def ns(self, case: str) -> list[float]:
        """Return the values varied in a case, in rising order."""
        return sorted({row.n for row in self.all if row.case == case})

    def contestants(self, case: str) -> list[str]:
        """In the order in which they ran."""
        return list(dict.fromkeys(row.contestant for row in self.all if row.case == case))

    def write(self, path: Path) -> None:
        """One line a row."""
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("w", newline="") as file:
            writer = csv.DictWriter(file, [field.name for field in fields(Row)], lineterminator="\n")
            writer.writeheader()
            writer.writerows(asdict(row) for row in self.all)

    @classmethod
    def read(cls, path: Path) -> Rows:
        """Read rows from a file; no rows if it doesn't exist."""
        if not path.is_file():
            return cls()
        with path.open(newline="") as file:
            return cls(
                Row(
                    line["case"],
                    float(line["n"]),
                    line["contestant"],
                    line["quantity"],
                    int(line["round"]),
                    float(line["value"]),
                )
                for line in csv.DictReader(file)
            )


def spread_of(values: Iterable[float]) -> Spread | None:
    """None of none."""
    found = list(values)
    return Spread(median(found), min(found), max(found)) if found else None
