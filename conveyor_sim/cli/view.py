"""The command view: a recording on a page."""

from __future__ import annotations

from pathlib import Path

import click


@click.command()
@click.argument("bag", type=click.Path(path_type=Path))
@click.option("--html", type=click.Path(path_type=Path), required=True, help="Write the page and BAG to this one file.")
@click.option("--last", type=float, help="Only so many s at the end; what happened is listed from the start.")
def view(bag: Path, html: Path, last: float | None) -> None:
    """Show the line in BAG on a page: play it, scrub, look at machines, alarms, forces and trends."""
    from conveyor_sim.view.one_file import write_page

    click.echo(write_page(bag, html, last))
