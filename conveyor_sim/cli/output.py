"""What commands print, and options that several have."""

from __future__ import annotations

import click
from rich.console import Console, RenderableType

OUTSIDE_TABLES = "Let SCENE name tables (CSV files) that lie outside its own folder."


def say(sentence: str) -> None:
    """What is happening, beside the results."""
    click.echo(sentence, err=True)


def show(content: RenderableType) -> None:
    """Prints to the terminal; brackets in names and paths mean nothing."""
    Console(markup=False, highlight=False).print(content)
