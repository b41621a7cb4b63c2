"""The pictures of an accuracy study, by name."""

from __future__ import annotations

from matplotlib.figure import Figure

from conveyor_sim.accuracy.results import Study
from conveyor_sim.plot.ensembles import ensembles_figure
from conveyor_sim.plot.orders import orders_figure
from conveyor_sim.plot.pareto import pareto_figure
from conveyor_sim.plot.stiffness import stiffness_figure


def accuracy_figures(study: Study) -> dict[str, Figure]:
    """`pareto` always; `orders`, `ensembles` and `stiffness` if the study has rows for them."""
    figures = {"pareto": pareto_figure(study)}
    if study.orders:
        figures["orders"] = orders_figure(study.orders, study.scene)
    if study.comparisons:
        figures["ensembles"] = ensembles_figure(study)
    if study.stiffness:
        figures["stiffness"] = stiffness_figure(study.stiffness, study.scene)
    return figures
