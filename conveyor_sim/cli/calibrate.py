# SPDX-License-Identifier: Apache-2.0
"""The command calibrate."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import click

from conveyor_sim.errors import ConveyorError
from conveyor_sim.support.garbage import collected_later


@click.command()
@click.argument("data", type=click.Path(path_type=Path), required=False)
@click.option("--output", "-o", type=click.Path(path_type=Path), help="File to write (default: standard output).")
@click.option("--example", is_flag=True, help="Print a file of measurements with all columns explained, and no more.")
def calibrate(data: Path | None, output: Path | None, example: bool) -> None:
    """Print entries of a scene from measurements: friction, restitution, stiffness, slip limit.

    DATA is a CSV file, one row per measurement (docs/calibration.md). Values have their 95 % intervals in comments;
    values that the measurements don't determine are named in comments.
    """
    from conveyor_sim.support.files import FileError, write_file

    if (data is None) != example:
        raise ConveyorError("calibrate: expected either DATA, a CSV file of measurements, or --example")
    if data is None:
        from conveyor_sim.studies.calibration.example import example as example_text

        text = example_text()
    else:
        if find_spec("scipy") is None:
            raise ConveyorError("calibrate: scipy is not installed, expected it (pip install 'conveyor_sim[studies]')")
        with collected_later():
            from conveyor_sim.studies.calibration.calibrate import calibrate as calibrated
            from conveyor_sim.studies.calibration.entries import entries
        text = entries(calibrated(data), data.name)
    if output is None:
        click.echo(text, nl=False)
        return
    try:
        write_file(output, text.encode())
    except FileError as error:
        raise ConveyorError(f"{output}: {error}, expected a file to write") from error
