"""Figures of scenes and recordings, each written as PNG and SVG."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import PlantFrame, StaticGeometry
from conveyor_sim.report.figures.files import write
from conveyor_sim.report.figures.heading import note_forced
from conveyor_sim.report.figures.line_efficiency import efficiency_figure
from conveyor_sim.report.figures.pictures import figures_of
from conveyor_sim.report.figures.state_bars import state_bars_figure
from conveyor_sim.report.figures.stop_reasons import stop_reasons_figure
from conveyor_sim.report.figures.views import scene_figure
from conveyor_sim.report.periods import stop_reasons
from conveyor_sim.report.production_record import Production
from conveyor_sim.scene import Scene


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
    with open_bag(bag) as opened, opened.sense(), style.look():
        drawn = {name: style.rendered(draw()) for name, draw in figures_of(opened, times, bottles).items()}
    return [path for name, picture in drawn.items() for path in write(picture, Path(out_dir) / name)]


def plot_production(production: Production, out_dir: str | Path) -> list[Path]:
    """Draw how a recorded line produced; returns the files written.

    `states` shows what its machines did over time, `stops` why they did not run, `efficiency` what was made of what the
    bottleneck could make. Nothing is drawn of a line without machines. Raises ConveyorError if the files can't be
    written.
    """
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
    path = Path(path)
    stem = path.with_suffix("") if path.suffix in (".png", ".svg") else path
    with style.look():
        return style.save(scene_figure(StaticGeometry.of(scene), PlantFrame.start_of(scene), scene.name), stem)[0]
