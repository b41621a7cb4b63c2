# SPDX-License-Identifier: Apache-2.0
"""Comparison with published experiments: runs the sources and renews docs/validation.md.

    make validation                             # all sources, one process per core; docs/validation.md states the time
    make validation ARGS="tipping chung_ooi"    # some of them
    make validation ARGS=--missing              # only the runs that are not stored yet
    make validation ARGS=--tables               # no run: page and pictures from the stored results

Each run is stored in docs/validation/ as soon as it has finished, so an interrupted study continues with --missing.
Seeds are fixed: the same program gives the same results for any number of processes.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

from conveyor_sim.support.interrupt import one_line, while_importing

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "docs" / "studies"))

with while_importing():
    import click

    from conveyor_sim.accuracy.measure.cpu import Meter
    from conveyor_sim.errors import ConveyorError
    from conveyor_sim.report.figures import style
    from conveyor_sim.report.figures.files import write
    from conveyor_sim.support.progress import ProgressBar
    from validation import page, sources, store
    from validation.source import Case, Run, Source


def one(name: str, case: Case) -> Run:
    """Run one case of a source. Return case, results and processor time."""
    with Meter() as meter:
        results = sources.source(name).simulate(case)
    return {**case, **results, store.CPU: max(0.0, round(meter.cpu - meter.compiling, 2))}


def measure(chosen: Mapping[str, Sequence[Case]], jobs: int) -> None:
    """Run the cases of the sources named, each stored as soon as it has finished.

    The longest runs start first, so that the processes end at about the same time.
    """
    known = {name: sources.source(name) for name in chosen}
    pending = sorted(((name, case) for name in chosen for case in chosen[name]), key=lambda job: -known[job[0]].seconds)
    total = sum(known[name].seconds for name, _ in pending)
    print(f"validation: {len(pending)} runs, about {total / 60.0 / jobs:.0f} min with {jobs} processes")
    with (
        ProgressBar("validation", total, counted="s of processor time (estimate)") as bar,
        ProcessPoolExecutor(jobs, get_context("spawn")) as pool,
    ):
        futures = {pool.submit(one, name, case): name for name, case in pending}
        bar.update(0)
        done = 0.0
        try:
            for future in as_completed(futures):
                source = known[futures[future]]
                keep(source, future.result())
                done += source.seconds
                bar.update(done)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)  # an error ends the study now, not after all other runs
            raise


def keep(source: Source, run: Run) -> None:
    """Replace the stored run of the same case."""
    name = store.key(source, run)
    store.write(source, [*(other for other in store.read(source) if store.key(source, other) != name), run])


def draw(source: Source) -> None:
    """Write the picture of a source, if it has one and all its runs are stored."""
    runs = store.read(source)
    if source.draw is not None and len(runs) == len(source.cases()):
        with style.look():
            write(style.rendered(source.draw(runs), (".svg",)), store.picture(source).with_suffix(""))


@click.command()
@one_line()
@click.argument("names", nargs=-1, metavar="[SOURCE]...", type=click.Choice(sources.MODULES))
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    default=len(os.sched_getaffinity(0)),
    show_default="one per core",
    help="Processes.",
)
@click.option("--missing", is_flag=True, help="Make only the runs that are not stored yet.")
@click.option("--tables", "only_tables", is_flag=True, help="Make no run; renew page and pictures.")
def main(names: tuple[str, ...], jobs: int, missing: bool, only_tables: bool) -> None:
    """Run SOURCE... (default: all) and renew docs/validation.md."""
    try:
        renew(names, jobs, missing, only_tables)
    except ConveyorError as error:
        raise click.ClickException(str(error)) from error


def renew(names: tuple[str, ...], jobs: int, missing: bool, only_tables: bool) -> None:
    """Run the sources named (none: all), unless only tables are wanted, and write pictures and page."""
    chosen = {}
    for source in (sources.source(name) for name in names or sources.MODULES):
        stored = {store.key(source, run) for run in store.read(source)} if missing else set()
        chosen[source.name] = [case for case in source.cases() if store.key(source, case) not in stored]
    if not only_tables and any(chosen.values()):
        measure(chosen, jobs)
    for name in chosen:
        draw(sources.source(name))
    page.PAGE.write_text(page.page(), encoding="utf-8")


if __name__ == "__main__":
    main()
