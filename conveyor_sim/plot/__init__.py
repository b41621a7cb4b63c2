"""Pictures of scenes, recordings and accuracy studies, each as PNG and SVG; only here matplotlib is imported."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from conveyor_sim.accuracy.results import Study
    from conveyor_sim.observe.production import Production
    from conveyor_sim.plot.response_data import Indices, Map, Response
    from conveyor_sim.plot.trials_data import TrialsData
    from conveyor_sim.scene import Scene

__all__ = ["plot_accuracy", "plot_bag", "plot_production", "plot_scene", "plot_study", "plot_trials"]

# Each imports what it draws with: a process that draws a recording needs no kernels, which studies do.


def plot_accuracy(study: Study, out_dir: str | Path) -> list[Path]:
    """Draw what an accuracy study found; returns the files written.

    `pareto` shows error against cost of every setting, `orders` the errors in closed forms, `ensembles` the long runs,
    `stiffness` what softer contacts change; a picture without rows is left out.
    Raises ConveyorError if the files can't be written.
    """
    from conveyor_sim.plot import style
    from conveyor_sim.plot.accuracy import accuracy_figures

    out = Path(out_dir)
    with style.look():
        figures = accuracy_figures(study)
        return [path for stem, figure in figures.items() for path in style.save(figure, out / stem)]


def plot_bag(
    bag: str | Path, out_dir: str | Path, times: Sequence[float] | None = None, bottles: Sequence[int] | None = None
) -> list[Path]:
    """Draw a recording in the manner of the paper's Figs. 6 to 9; returns the files written.

    `table` shows the widest belt at `times` (s; nearest recorded, default a quarter, half, three quarters and the end),
    `plant` everything at the last of them, `velocity_bottle_ID` the `bottles` (ids; default the 1st and the 50th fed),
    `flow` and `force` the whole run, `energy` too if its ledger was recorded, `damage_rails` and
    `damage_bottles` if damage was.
    Raises BagError if the bag can't be read, ConveyorError for a time or bottle that it does not hold.
    """
    from conveyor_sim.bag.reader import open_bag
    from conveyor_sim.plot import style
    from conveyor_sim.plot.files import write
    from conveyor_sim.plot.pictures import figures_of

    with open_bag(bag) as opened, opened.sense(), style.look():
        drawn = {name: style.rendered(draw()) for name, draw in figures_of(opened, times, bottles).items()}
    return [path for name, picture in drawn.items() for path in write(picture, Path(out_dir) / name)]


def plot_production(production: Production, out_dir: str | Path) -> list[Path]:
    """Draw how a recorded line produced; returns the files written.

    `states` shows what its machines did over time, `stops` why they did not run, `efficiency` what was made of what the
    bottleneck could make. Nothing is drawn of a line without machines. Raises ConveyorError if the files can't be
    written.
    """
    from conveyor_sim.observe.periods import stop_reasons
    from conveyor_sim.plot import style
    from conveyor_sim.plot.heading import note_forced
    from conveyor_sim.plot.line_efficiency import efficiency_figure
    from conveyor_sim.plot.state_bars import state_bars_figure
    from conveyor_sim.plot.stop_reasons import stop_reasons_figure

    if not production.periods:
        return []
    name, periods = production.scene, production.periods
    reasons = stop_reasons(period for machine in periods.values() for period in machine)
    with style.look():
        figures = {
            "states": state_bars_figure(periods, production.start, production.end, name),
            "stops": stop_reasons_figure(reasons, name),
            "efficiency": efficiency_figure(production.counters, production.time, production.good, name),
        }
        for figure in figures.values():
            note_forced(figure, production.forced)
        return [path for stem, figure in figures.items() for path in style.save(figure, Path(out_dir) / stem)]


def plot_scene(scene: Scene, path: str | Path) -> Path:
    """Draw a scene before it runs, to `path` with the suffixes .png and .svg; returns the PNG.

    Raises ConveyorError if the files can't be written.
    """
    from conveyor_sim.plot import style
    from conveyor_sim.plot.data import Frame, Plant
    from conveyor_sim.plot.views import scene_figure

    path = Path(path)
    stem = path.with_suffix("") if path.suffix in (".png", ".svg") else path
    with style.look():
        return style.save(scene_figure(Plant.of(scene), Frame.start_of(scene), scene.name), stem)[0]


def plot_study(
    name: str,
    effects: Sequence[Sequence[Sequence[Response]]],
    interactions: Mapping[str, Sequence[Sequence[Sequence[Response]]]],
    maps: Mapping[str, Map],
    indices: Sequence[Indices],
    out_dir: str | Path,
) -> list[Path]:
    """Draw what a study found; returns the files written.

    `response` shows each metric over each parameter, `interactions_<metric>` over each pair of them, `map_<metric>`
    over both of two, `indices` the Sobol indices; a picture of nothing is left out.
    Raises ConveyorError if the files can't be written.
    """
    from conveyor_sim.plot import style
    from conveyor_sim.plot.responses import indices_figure, map_figure, responses_figure

    with style.look():
        figures = {"response": responses_figure(effects, name)}
        for metric, panels in interactions.items():
            figures[f"interactions_{metric}"] = responses_figure(panels, f"{name}: interactions")
        figures |= {f"map_{metric}": map_figure(found, name) for metric, found in maps.items()}
        if indices:
            figures["indices"] = indices_figure(indices, f"{name}: Sobol indices")
        return [path for stem, figure in figures.items() for path in style.save(figure, Path(out_dir) / stem)]


def plot_trials(trials: TrialsData, out_dir: str | Path) -> list[Path]:
    """Draw what an optimisation tried, as `trials`; returns the files written.

    With two goals that is one against the other, with the front; with one how the best came about.
    Raises ConveyorError if the files can't be written.
    """
    from conveyor_sim.plot import style
    from conveyor_sim.plot.trials import trials_figure

    with style.look():
        return style.save(trials_figure(trials), Path(out_dir) / "trials")
