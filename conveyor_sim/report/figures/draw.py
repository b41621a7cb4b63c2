# SPDX-License-Identifier: Apache-2.0
"""Figures of scenes and recordings, each written as PNG and SVG."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from conveyor_sim.bag.reader import Bag, open_bag
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.damage import bottles_figure, rails_figure
from conveyor_sim.report.figures.data import PlantFrame, StaticGeometry
from conveyor_sim.report.figures.energy import energy_figure
from conveyor_sim.report.figures.files import write
from conveyor_sim.report.figures.flow import flow_figure, force_figure
from conveyor_sim.report.figures.production import efficiency_figure, state_bars_figure, stop_reasons_figure
from conveyor_sim.report.figures.recording import Recording
from conveyor_sim.report.figures.series import velocity_figure
from conveyor_sim.report.figures.views import plant_figure, scene_figure, table_figure
from conveyor_sim.report.periods import stop_reasons
from conveyor_sim.report.production import Production
from conveyor_sim.scene import Scene

Figures = Mapping[str, Callable[[], Figure]]
"""Drawing functions by file name, in listing order."""


def figures_of(bag: Bag, times: Sequence[float] | None, bottles: Sequence[int] | None) -> Figures:
    """Return the figures of an open bag, with all data read; `times` and `bottles` as in `plot_bag`.

    Raise BagError and ConveyorError as `plot_bag` does.
    """
    recording = Recording(bag)
    frames, plant, name = recording.frames(times), recording.plant, recording.scene.name
    end = float(recording.flow.time[-1])
    peak = float(recording.peak_force.largest.max())
    figures: dict[str, Callable[[], Figure]] = {
        "table": partial(table_figure, plant, frames, name, peak),
        "plant": partial(plant_figure, plant, frames[-1], name, peak),
    }
    for velocity in recording.velocities(bottles):
        figures[f"velocity_bottle_{velocity.bottle}"] = partial(velocity_figure, velocity, recording.belts, end)
    figures["flow"] = partial(flow_figure, recording.flow, recording.belts)
    figures["force"] = partial(force_figure, recording.peak_force)
    energy, damage = recording.energy, recording.damage
    if energy is not None:
        figures["energy"] = partial(energy_figure, energy, recording.belts)
    if damage is not None:
        figures["damage_bottles"] = partial(bottles_figure, damage, name)
        if len(damage.wear.rail):
            figures["damage_rails"] = partial(rails_figure, plant, damage, name)
    if recording.forced:
        return {name: partial(_noted, draw, recording.forced) for name, draw in figures.items()}
    return figures


def _noted(draw: Callable[[], Figure], forced: Sequence[str]) -> Figure:
    figure = draw()
    style.note_forced(figure, forced)
    return figure


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
            style.note_forced(figure, production.forced)
        return [path for stem, figure in figures.items() for path in style.save(figure, Path(out_dir) / stem)]


def plot_scene(scene: Scene, path: str | Path) -> Path:
    """Draw a scene before it runs, to `path` with the suffixes .png and .svg; returns the PNG.

    Raises ConveyorError if the files can't be written.
    """
    path = Path(path)
    stem = path.with_suffix("") if path.suffix in (".png", ".svg") else path
    with style.look():
        return style.save(scene_figure(StaticGeometry.of(scene), PlantFrame.start_of(scene), scene.name), stem)[0]
