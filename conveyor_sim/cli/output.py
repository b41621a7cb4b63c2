# SPDX-License-Identifier: Apache-2.0
"""Output of commands, and options that several commands share."""

from __future__ import annotations

import json
import math
import os
import shutil
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import click
from rich.console import Console, RenderableType


class Number(click.FloatRange):
    """A number in a range, and never NaN, which no comparison finds outside."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Convert text to a number in the range; NaN is refused."""
        number: float = super().convert(value, param, ctx)
        if math.isnan(number):
            self.fail(f"{value} is not in the range {self._describe_range()}.", param, ctx)
        return number


def say(sentence: str) -> None:
    """Print progress to the standard error, apart from the results."""
    click.echo(sentence, err=True)


def show(content: RenderableType) -> None:
    """Print to the terminal; brackets in names and paths are not markup."""
    Console(markup=False, highlight=False).print(content)


def line_width() -> int | None:
    """Return the characters of a line of the standard output: those of the terminal, or COLUMNS; else None."""
    if sys.stdout.isatty() or os.environ.get("COLUMNS", "").isdecimal():
        return shutil.get_terminal_size().columns
    return None


def show_lines(lines: Sequence[str]) -> None:
    """Print lines, through the pager if they are more than the terminal has."""
    if sys.stdout.isatty() and len(lines) >= shutil.get_terminal_size().lines:
        click.echo_via_pager("\n".join(lines) + "\n")
        return
    for line in lines:
        click.echo(line)


def show_json(records: Iterable[Mapping[str, Any]]) -> None:
    """Print a JSON array with one object per line. Values that are not finite are null."""
    before = "["
    for record in records:
        finite = {name: None if isinstance(v, float) and not math.isfinite(v) else v for name, v in record.items()}
        click.echo(f"{before}\n{json.dumps(finite, ensure_ascii=False)}", nl=False)
        before = ","
    click.echo("[]" if before == "[" else "\n]")
