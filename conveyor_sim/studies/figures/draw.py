"""Figures of studies and optimisations, each written as PNG and SVG."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from conveyor_sim.report.figures import style
from conveyor_sim.studies.figures.data import Indices, Map, Response, TrialsData
from conveyor_sim.studies.figures.responses import indices_figure, map_figure, responses_figure
from conveyor_sim.studies.figures.trials import trials_figure


def plot_study(
    name: str,
    effects: Sequence[Sequence[Sequence[Response]]],
    interactions: Mapping[str, Sequence[Sequence[Sequence[Response]]]],
    maps: Mapping[str, Map],
    indices: Sequence[Indices],
    out_dir: str | Path,
) -> list[Path]:
    """Draw a study and return the files written.

    `response` shows each metric over each parameter, `interactions_<metric>` over each pair of them, `map_<metric>`
    over both of two, `indices` the Sobol indices; a picture of nothing is left out.
    Raises ConveyorError if the files can't be written.
    """
    with style.look():
        figures = {"response": responses_figure(effects, name)}
        for metric, panels in interactions.items():
            figures[f"interactions_{metric}"] = responses_figure(panels, f"{name}: interactions")
        figures |= {f"map_{metric}": map_figure(data, name) for metric, data in maps.items()}
        if indices:
            figures["indices"] = indices_figure(indices, f"{name}: Sobol indices")
        return [path for stem, figure in figures.items() for path in style.save(figure, Path(out_dir) / stem)]


def plot_trials(trials: TrialsData, out_dir: str | Path) -> list[Path]:
    """Draw what an optimisation tried, as `trials`; returns the files written.

    With two goals that is one against the other, with the front; with one how the best came about.
    Raises ConveyorError if the files can't be written.
    """
    with style.look():
        return style.save(trials_figure(trials), Path(out_dir) / "trials")
