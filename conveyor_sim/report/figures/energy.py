# SPDX-License-Identifier: Apache-2.0
"""The energy ledger over time: what came, what is held, what went, and what does not close."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from conveyor_sim.physics.timestep.prediction import percent
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import EnergySeries, Floats

_BELTS: Final = len(style.SERIES) - 2  # that have a curve of their own, beside bottles and the other belts

Curve = tuple[str, Floats]


def energy_figure(energy: EnergySeries, belts: Sequence[str]) -> Figure:
    """Work of the belts that do most and of moving rails, what bottles brought; what is held; what went; the residual.

    Accounts in which nothing ever was are left out.
    """
    figure = style.new_figure(13.0, 7.2)
    [[came, went], [held, residual]] = figure.subplots(2, 2, sharex=True)
    brought = [("rails that move", energy.rails), ("brought by bottles", energy.fed)]
    _curves(came, "Came", energy.time, [*_work(energy.belts, belts), *brought])
    _curves(
        went,
        "Went",
        energy.time,
        [
            ("friction under bottles", energy.base_friction),
            ("friction at contacts", energy.contact_friction),
            ("damping", energy.damping),
            ("taken along by bottles", energy.removed),
        ],
    )
    _curves(
        held,
        "Held",
        energy.time,
        [("motion", energy.kinetic), ("contacts", energy.elastic), ("tangential springs", energy.springs)],
    )
    share = np.divide(energy.residual, energy.turnover, out=np.zeros_like(energy.time), where=energy.turnover > 0.0)
    residual.plot(energy.time, 100.0 * share, color=style.SERIES[1], linewidth=1.2, gid="residual")
    residual.set_title("Residual: the integrator's error")
    residual.set_ylabel("percent of the turnover")
    for ax in (came, went, held, residual):
        ax.grid(True)
        ax.axhline(0.0, color=style.MUTED, linewidth=0.7, zorder=1.0)
        ax.tick_params(labelbottom=True)
        ax.set_xlabel("time (s)")
        ax.set_xlim(energy.time[0], energy.time[-1] if len(energy.time) > 1 else energy.time[0] + 1.0)
    end = f"{energy.residual[-1]:.2g} J of a turnover of {energy.turnover[-1]:.4g} J, {percent(float(share[-1]))}"
    style.heading(figure, f"Energy: what does not close at the end is {end}")
    return figure


def _work(work: Floats, belts: Sequence[str]) -> list[Curve]:
    """Return curves of the belts with most work, in listing order, and one curve of the others."""
    most = np.argsort(-np.abs(work).max(axis=0, initial=0.0), kind="stable")
    own, others = sorted(most[:_BELTS].tolist()), most[_BELTS:]
    curves = [(belts[index], work[:, index]) for index in own]
    if len(others) == 1:
        curves.append((belts[int(others[0])], work[:, int(others[0])]))
    elif len(others) > 1:
        curves.append((f"{len(others)} other belts", work[:, others].sum(axis=1)))
    return curves


def _curves(ax: Axes, title: str, time: Floats, curves: Sequence[Curve]) -> None:
    ax.set_title(title)
    ax.set_ylabel("energy (J)")
    drawn = [(name, values) for name, values in curves if values.any()]
    for (name, values), colour in zip(drawn, style.SERIES, strict=False):
        ax.plot(time, values, color=colour, linewidth=1.4, label=f"{name} ({values[-1]:.3g} J)", gid=name)
    if drawn:
        ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=8.5)
