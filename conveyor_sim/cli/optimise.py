# SPDX-License-Identifier: Apache-2.0
"""The command optimise."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import click

from conveyor_sim.cli.output import say
from conveyor_sim.cli.studies import engine_of, shown_runs
from conveyor_sim.support.garbage import collected_later


@click.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder (default: runs/study_<name>_<hash>).")
@click.option("--processes", type=click.IntRange(1), help="On this machine (default: one for each core).")
@click.option("--dask", help="Workers of Dask instead: the address of a scheduler, or `local`.")
@click.option("--no-pictures", is_flag=True, help="Print only.")
def optimise(study: Path, out: Path | None, processes: int | None, dask: str | None, no_pictures: bool) -> None:
    """Find the parameters that are best by the objective of STUDY (YAML).

    The best point is then compared with the one that it started from, on seeds that no trial had. Finished runs are
    kept: the same command goes on after a Ctrl-C, a crash or a full disk, and with more trials.
    """
    with collected_later():
        from conveyor_sim.report.report import can_draw
        from conveyor_sim.studies.check import check_study
        from conveyor_sim.studies.load import load_study
        from conveyor_sim.studies.optimisation.answer import answer, trials_data
        from conveyor_sim.studies.optimisation.optimise import optimise as found_by
        from conveyor_sim.studies.optimisation.optimise import wanted_of
        from conveyor_sim.studies.optimisation.search import require_optuna
        from conveyor_sim.studies.results import PARQUET, read_results, write_parquet
        from conveyor_sim.studies.sweep import study_folder

    require_optuna()
    setup = load_study(study)
    check_study(setup, wanted_of(setup).first(setup.study.parameters))
    folder = study_folder(setup) if out is None else out
    with shown_runs(setup, folder, engine_of(processes, dask)) as (runs, display):
        optimum = found_by(runs, setup, display.update)
    results = read_results(folder)
    units = results.units
    for line in answer(optimum, units):
        click.echo(line)
    if not no_pictures and can_draw():
        from conveyor_sim.studies.figures.draw import plot_trials

        for picture in plot_trials(trials_data(setup.study.name, optimum, units), folder / "pictures"):
            click.echo(f"picture: {picture}")
    if find_spec("pyarrow") is None:
        say("no Parquet file: pyarrow is not installed (pip install 'conveyor_sim[optimise]')")
    else:
        click.echo(f"table: {write_parquet(results, folder / PARQUET)}")
