"""Pictures of scenes, recordings and accuracy studies, each as PNG and SVG; only here matplotlib is imported."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.plot import style
from conveyor_sim.plot.accuracy import accuracy_figures
from conveyor_sim.plot.damage import bottles_figure, rails_figure
from conveyor_sim.plot.data import Frame, Plant
from conveyor_sim.plot.energy import energy_figure
from conveyor_sim.plot.flow import flow_figure, force_figure
from conveyor_sim.plot.recording import Recording
from conveyor_sim.plot.series import velocity_figure
from conveyor_sim.plot.views import plant_figure, scene_figure, table_figure

if TYPE_CHECKING:
    from conveyor_sim.accuracy.results import Study
    from conveyor_sim.scene import Scene

__all__ = ["plot_accuracy", "plot_bag", "plot_scene"]


def plot_accuracy(study: Study, out_dir: str | Path) -> list[Path]:
    """Draw what an accuracy study found; returns the files written.

    `pareto` shows error against cost of every setting, `orders` the errors in closed forms, `ensembles` the long runs,
    `stiffness` what softer contacts change; a picture without rows is left out.
    Raises ConveyorError if the files can't be written.
    """
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
    out = Path(out_dir)
    with open_bag(bag) as opened, opened.sense(), style.look():
        recording = Recording(opened)
        frames = recording.frames(times)
        velocities = recording.velocities(bottles)
        end = float(recording.flow.time[-1])
        name = recording.scene.name
        peak = float(recording.peak_force.largest.max())
        figures = {
            "table": table_figure(recording.plant, frames, name, peak),
            "plant": plant_figure(recording.plant, frames[-1], name, peak),
            **{f"velocity_bottle_{v.bottle}": velocity_figure(v, recording.belts, end) for v in velocities},
            "flow": flow_figure(recording.flow, recording.belts),
            "force": force_figure(recording.peak_force),
        }
        energy = recording.energy
        if energy is not None:
            figures["energy"] = energy_figure(energy, recording.belts)
        damage = recording.damage
        if damage is not None:
            figures["damage_bottles"] = bottles_figure(damage, name)
            if len(damage.wear.rail):
                figures["damage_rails"] = rails_figure(recording.plant, damage, name)
        return [path for stem, figure in figures.items() for path in style.save(figure, out / stem)]


def plot_scene(scene: Scene, path: str | Path) -> Path:
    """Draw a scene before it runs, to `path` with the suffixes .png and .svg; returns the PNG.

    Raises ConveyorError if the files can't be written.
    """
    path = Path(path)
    stem = path.with_suffix("") if path.suffix in (".png", ".svg") else path
    with style.look():
        return style.save(scene_figure(Plant.of(scene), Frame.start_of(scene), scene.name), stem)[0]
