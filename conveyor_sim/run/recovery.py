# SPDX-License-Identifier: Apache-2.0
"""Command `recover`: repairs a recording, or makes one from the inputs that a killed test left."""

from __future__ import annotations

from pathlib import Path

import click

from conveyor_sim.bag.input_log import input_folders
from conveyor_sim.bag.recover import recover
from conveyor_sim.bag.rerun import rerun
from conveyor_sim.errors import BagError
from conveyor_sim.support.printable import SENTENCE, printable
from conveyor_sim.support.progress import ProgressBar


def recover_bag(bag: Path) -> None:
    """Repair a recording. Raise BagError if that fails, or if the rest can't be replayed."""
    report = recover(bag)
    for sentence in report.damage:
        click.echo(printable(sentence, SENTENCE))
    for phrase in report.unverified:
        click.echo(f"{printable(phrase, SENTENCE)}: has no checksum, so it can't be verified")
    for sentence in report.skipped:
        click.echo(printable(sentence, SENTENCE))
    what = f"{report.message_count} messages up to {report.end_ns * 1e-9:.2f} s"
    skipping = ", apart from the parts that were skipped" if report.skipped else ""
    if not report.healthy:
        click.echo(f"{bag}: repaired, with {what}")
    elif report.unverified:
        click.echo(f"{bag}: no damage was found{skipping}, nothing to do ({what})")
    else:
        click.echo(f"{bag}: is intact{skipping}, every checksum is right, nothing to do ({what})")
    for file in report.kept:
        click.echo(f"the damaged original is kept as {file}")
    if report.unusable and not report.healthy:
        raise BagError(f"{report.unusable}; other programs can read it, but it can't be replayed or drawn")


def recover_runs(folder: Path) -> bool:
    """Make the bags of all runs whose inputs are in a folder, in folders `bag` beside them. Return False if none are.

    Raise BagError, SceneError or CheckpointError. A bag of another run in a folder `bag` is an error as well. It
    is not overwritten.
    """
    folders = input_folders(folder)
    for place in folders:
        with ProgressBar(f"{place}, run again", 0.0) as bar:
            made = rerun(place, place / "bag", bar.update)
        click.echo(f"{made.bag}: the run up to {made.end:.2f} s")
        if made.departure:
            raise BagError(f"{place}: {made.departure}")
    return bool(folders)
