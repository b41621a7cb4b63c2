# SPDX-License-Identifier: Apache-2.0
"""The command view: a recording on a page."""

from __future__ import annotations

from pathlib import Path

import click

from conveyor_sim.errors import ConveyorError


@click.command()
@click.argument("bag", type=click.Path(path_type=Path))
@click.argument("other", type=click.Path(path_type=Path), required=False)
@click.option(
    "--html", type=click.Path(path_type=Path), help="Write the page and what it shows to this one file, and end."
)
@click.option("--last", type=float, help="With --html: only the last seconds of the recording.")
@click.option("--port", type=click.IntRange(0, 65535), help="Without --html: serve the page here (default: any).")
def view(bag: Path, other: Path | None, html: Path | None, last: float | None, port: int | None) -> None:
    """Show the line in BAG on a page: play it, scrub, look at machines, alarms, forces and trends.

    The page is served to this machine, however long BAG is, until Ctrl-C; or it is written to one file with --html.

    With OTHER, another recording, both are shown side by side at the same simulated time, and where they first differ.
    """
    if html is not None:
        if port is not None:
            raise ConveyorError("--port: given with --html, expected one of them")
        if last is not None and not 0.0 < last < float("inf"):
            raise ConveyorError(f"--last: {last:g} given, expected a number above 0")
        from conveyor_sim.page.one_file import write_page

        click.echo(write_page(bag, html, last, other=other))
        return
    if last is not None:
        raise ConveyorError("--last: given without --html, expected both or neither")
    from conveyor_sim.page.server import RecordingServer
    from conveyor_sim.support.stop_request import StopRequest

    with StopRequest() as stop, RecordingServer(bag, port or 0, other) as server:
        click.echo(f"{bag}: {server.url} (Ctrl-C ends it)")
        stop.wait()
