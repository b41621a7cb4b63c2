# SPDX-License-Identifier: Apache-2.0
"""Figures of an accuracy study, each written as PNG and SVG."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from conveyor_sim.accuracy.figures.ensembles import ensembles_figure
from conveyor_sim.accuracy.figures.orders import orders_figure
from conveyor_sim.accuracy.figures.pareto import pareto_figure
from conveyor_sim.accuracy.figures.stiffness import stiffness_figure
from conveyor_sim.accuracy.results import AccuracyStudy
from conveyor_sim.report.figures import style


def accuracy_figures(study: AccuracyStudy) -> dict[str, Figure]:
    """`pareto` always; `orders`, `ensembles` and `stiffness` if the study has rows for them."""
    figures = {"pareto": pareto_figure(study)}
    if study.orders:
        figures["orders"] = orders_figure(study.orders, study.scene)
    if study.comparisons:
        figures["ensembles"] = ensembles_figure(study)
    if study.stiffness:
        figures["stiffness"] = stiffness_figure(study.stiffness, study.scene)
    return figures


def plot_accuracy(study: AccuracyStudy, out_dir: str | Path) -> list[Path]:
    """Draw an accuracy study and return the files written.

    `pareto` shows error against cost of every setting, `orders` the errors in closed forms, `ensembles` the long runs,
    `stiffness` what softer contacts change; a picture without rows is left out.
    Raises ConveyorError if the files can't be written.
    """
    out = Path(out_dir)
    with style.look():
        figures = accuracy_figures(study)
        return [path for stem, figure in figures.items() for path in style.save(figure, out / stem)]
