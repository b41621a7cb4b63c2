# SPDX-License-Identifier: Apache-2.0
"""Commands on studies: sweep, study."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import click

from conveyor_sim.cli.output import say, show
from conveyor_sim.errors import ConveyorError
from conveyor_sim.support.garbage import collected_later

if TYPE_CHECKING:
    from conveyor_sim.studies.display import Display
    from conveyor_sim.studies.runs import Engine, Runs
    from conveyor_sim.studies.setup import Setup


@click.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder (default: runs/study_<name>_<hash>).")
@click.option("--processes", type=click.IntRange(1), help="On this machine (default: one for each core).")
@click.option("--dask", help="Workers of Dask instead: the address of a scheduler, or `local`.")
@click.option("--set", "given", multiple=True, metavar="NAME=VALUE", help="One run alone, with --seed: a parameter.")
@click.option("--seed", type=click.IntRange(0), help="Of the run alone.")
@click.option("--warm-up", type=click.FloatRange(0), help="Of the run alone: s, of a study with `warm_up: mser`.")
@click.option("--record", type=click.Path(path_type=Path), help="Of the run alone: folder to record to.")
def sweep(
    study: Path,
    out: Path | None,
    processes: int | None,
    dask: str | None,
    given: tuple[str, ...],
    seed: int | None,
    warm_up: float | None,
    record: Path | None,
) -> None:
    """Run a scene at many points and seeds, as STUDY (YAML) says.

    Each finished run is stored in a separate file; the same command goes on after a Ctrl-C, a crash or a full disk.
    At the end all runs are in one Parquet file, and `conveyor-sim study` draws them.
    """
    if find_spec("scipy") is None:
        raise ConveyorError("sweep: scipy is not installed, expected it (pip install 'conveyor_sim[studies]')")
    with collected_later():
        from conveyor_sim.studies.check import check_study
        from conveyor_sim.studies.load import load_study

    setup = load_study(study)
    if given or seed is not None or warm_up is not None or record is not None:
        if not given or seed is None or out or processes or dask:
            raise ConveyorError(
                "--set, --seed, --warm-up, --record: expected --set for each parameter and --seed, and no others"
            )
        _alone(setup, given, seed, warm_up, record)
        return
    check_study(setup)
    _sweep(setup, out, engine_of(processes, dask))


def engine_of(processes: int | None, dask: str | None) -> Callable[[], Engine]:
    """Return a function that builds the engine of these options. Raise ConveyorError for contradictory options."""
    if dask is None:
        from conveyor_sim.support.worker_pool import WorkerPool

        return lambda: WorkerPool(processes)
    if find_spec("distributed") is None:
        raise ConveyorError("--dask: distributed is not installed, expected it (pip install 'conveyor_sim[dask]')")
    if processes is not None and dask != "local":
        raise ConveyorError("--processes: given with the address of a scheduler, expected one of them")
    from conveyor_sim.studies.dask_engine import DaskEngine

    return lambda: DaskEngine(dask, processes, say)


@contextmanager
def shown_runs(setup: Setup, folder: Path, engine: Callable[[], Engine]) -> Iterator[tuple[Runs, Display]]:
    """Yield the runs of a study and their progress display; after a Ctrl-C print how to continue.

    Raise StudyError as `Runs`.
    """
    from conveyor_sim.studies.display import Display
    from conveyor_sim.studies.runs import Runs

    try:
        with Runs(setup, folder, engine(), say) as runs, Display(setup) as display:
            yield runs, display
    except KeyboardInterrupt:
        say(f"finished runs are kept in {folder}; the same command goes on with them")
        raise


def _sweep(setup: Setup, out: Path | None, engine: Callable[[], Engine]) -> None:
    from conveyor_sim.studies.results import PARQUET, read_results, write_parquet
    from conveyor_sim.studies.sweep import study_folder, sweep
    from conveyor_sim.studies.table import points_table
    from conveyor_sim.studies.verdict import wider_than_wanted

    folder = study_folder(setup) if out is None else out
    with shown_runs(setup, folder, engine) as (runs, display):
        rows = sweep(runs, setup, display.update)
    results = read_results(folder)
    show(points_table(rows, results.units, results.parameters))
    for sentence in wider_than_wanted(results):
        click.echo(sentence)
    for row in rows:
        if row.status != "finished":
            click.echo(f"{row.status}: {row.error}: {results.command(row)}")
    click.echo(f"any run alone: {results.command(rows[0])}")
    if find_spec("pyarrow") is None:
        say("no Parquet file: pyarrow is not installed (pip install 'conveyor_sim[studies]')")
    else:
        click.echo(f"table: {write_parquet(results, folder / PARQUET)}")
    click.echo(f"pictures: conveyor-sim study {folder}")


def _alone(setup: Setup, given: tuple[str, ...], seed: int, warm_up: float | None, record: Path | None) -> None:
    from conveyor_sim.studies.run import job_of, run_alone
    from conveyor_sim.studies.study import MSER

    if warm_up is None and setup.study.warm_up == MSER:
        raise ConveyorError("--warm-up: missing, expected the seconds that the study has found, as its results say")
    if warm_up is not None and setup.study.warm_up != MSER:
        raise ConveyorError(f"--warm-up: {warm_up:g} given, expected none: the study states a warm_up")
    setup = setup if warm_up is None else setup.with_warm_up(warm_up)
    job = job_of(setup, given, seed)
    row = run_alone(setup, job, record)
    for name, value in row.metrics.items():
        click.echo(f"{name}: {value!r}")
    if record is not None:
        click.echo(f"recorded to {record}")


@click.command("study")
@click.argument("results", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder for the pictures (default: `pictures` beside it).")
@click.option("--sobol", is_flag=True, help="Sobol indices, too, of a study with design: saltelli.")
@click.option("--no-pictures", is_flag=True, help="Print only.")
def study_(results: Path, out: Path | None, sobol: bool, no_pictures: bool) -> None:
    """Print and draw what a study has found.

    RESULTS is its folder, finished or not, or its Parquet file.
    """
    with collected_later():
        from conveyor_sim.report.report import can_draw
        from conveyor_sim.studies.effects import indices, interactions, main_effects, maps
        from conveyor_sim.studies.results import read_results
        from conveyor_sim.studies.table import points_table
        from conveyor_sim.studies.verdict import verdicts

    found = read_results(results)
    if not found.verified:
        say(f"{results}: was made by an older version without checksums, so it can't be verified")
    if not any(row.status == "finished" for row in found.rows):
        raise ConveyorError(f"{results}: none of its {len(found.rows)} runs has finished, expected one at least")
    show(points_table(found.rows, found.units, found.parameters))
    if found.warm_up is not None:
        click.echo(f"warm-up: {found.warm_up:g} s, by rule MSER-5")
    for sentence in verdicts(found):
        click.echo(sentence)
    shares = indices(found) if sobol else []
    if not no_pictures and can_draw():
        from conveyor_sim.studies.figures.draw import plot_study

        pairs = {metric: panels for metric in found.units if (panels := interactions(found, metric))}
        place = out or (results if results.is_dir() else results.parent) / "pictures"
        for picture in plot_study(found.name, main_effects(found), pairs, maps(found), shares, place):
            click.echo(picture)
