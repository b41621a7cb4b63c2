"""Output of commands, and options that several commands share."""

from __future__ import annotations

import math
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
