# SPDX-License-Identifier: Apache-2.0
"""The energy ledger is drawn as recorded."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from bag.small_line import SMALL_LINE, record
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import EnergySeries
from conveyor_sim.report.figures.energy import energy_figure
from conveyor_sim.report.figures.recording import Recording
from conveyor_sim.scene import load_scene


@pytest.fixture(autouse=True)
def look() -> Iterator[None]:
    with style.look():
        yield


def line(figure: Figure, gid: str) -> Line2D:
    (found,) = [line for ax in figure.axes for line in ax.lines if line.get_gid() == gid]
    return found


def test_every_account_is_drawn_as_recorded(tmp_path: Path) -> None:
    simulation = record(load_scene(SMALL_LINE, {"outputs": {"ledger": 20}}), tmp_path / "bag", 100)
    with open_bag(tmp_path / "bag") as opened:
        frames = list(opened.read("ledger"))
        recording = Recording(opened)
        energy = recording.energy
    assert energy is not None
    figure = energy_figure(energy, recording.belts)
    np.testing.assert_array_equal(line(figure, "straight").get_ydata(), [f.data.belt_work[0] for f in frames])
    for gid, field in {
        "friction under bottles": "base_friction",
        "friction at contacts": "contact_friction",
        "damping": "damping",
        "taken along by bottles": "removed",
        "brought by bottles": "fed",
        "motion": "kinetic",
        "contacts": "elastic",
    }.items():
        drawn = line(figure, gid)
        np.testing.assert_array_equal(drawn.get_ydata(), [getattr(f.data, field) for f in frames])
        np.testing.assert_array_equal(drawn.get_xdata(), [f.time for f in frames])
    share = [100.0 * f.data.residual / f.data.turnover for f in frames]
    np.testing.assert_allclose(np.asarray(line(figure, "residual").get_ydata()), share)
    ledger = simulation.ledger()
    assert ledger is not None
    assert f"{ledger.residual:.2g} J of a turnover of {ledger.turnover:.4g} J" in figure.get_suptitle()


def test_a_line_at_rest_has_nothing_to_divide_by() -> None:
    """No belts, nothing in motion: no curve but the residual's."""
    zero = np.zeros(3)
    still = EnergySeries(np.arange(3.0), *[zero] * 5, np.zeros((3, 0)), *[zero] * 6)
    figure = energy_figure(still, [])
    np.testing.assert_array_equal(line(figure, "residual").get_ydata(), zero)
    assert [ax.get_legend() for ax in figure.axes] == [None] * 4


def test_belts_that_do_least_are_drawn_together() -> None:
    zero, work = np.zeros(3), np.outer(np.arange(3.0), [1.0, -9.0, 2.0, 7.0, 8.0, 3.0])
    figure = energy_figure(EnergySeries(np.arange(3.0), *[zero] * 5, work, *[zero] * 6), list("abcdef"))
    for index, name in ((1, "b"), (3, "d"), (4, "e"), (5, "f")):
        np.testing.assert_array_equal(line(figure, name).get_ydata(), work[:, index])
    np.testing.assert_array_equal(line(figure, "2 other belts").get_ydata(), work[:, 0] + work[:, 2])


def test_a_bag_without_a_ledger_has_no_such_picture(tmp_path: Path) -> None:
    record(load_scene(SMALL_LINE), tmp_path / "bag", 4)
    with open_bag(tmp_path / "bag") as opened:
        assert Recording(opened).energy is None
