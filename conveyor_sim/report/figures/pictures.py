"""Figures of a recording by name; each can be drawn separately, in any process."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from matplotlib.figure import Figure

from conveyor_sim.bag.reader import Bag
from conveyor_sim.report.figures.damage import bottles_figure, rails_figure
from conveyor_sim.report.figures.energy import energy_figure
from conveyor_sim.report.figures.flow import flow_figure, force_figure
from conveyor_sim.report.figures.heading import note_forced
from conveyor_sim.report.figures.recording import Recording
from conveyor_sim.report.figures.series import velocity_figure
from conveyor_sim.report.figures.views import plant_figure, table_figure

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
    note_forced(figure, forced)
    return figure
