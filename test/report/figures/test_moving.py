# SPDX-License-Identifier: Apache-2.0
"""Rails that move in pictures and in the summary: where and what they were when they were recorded."""

from pathlib import Path

import numpy as np
import pytest
from physics.test_moving_rails import SPEED, plant
from scenes import NO_OUTPUTS, RADIUS, bottle

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.energy import energy_figure
from conveyor_sim.report.figures.plant import draw_rails
from conveyor_sim.report.figures.recording import Recording
from conveyor_sim.report.summarize import summarize


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A pusher hits a bottle."""
    path = tmp_path_factory.mktemp("bags") / "pushed"
    outputs = {**NO_OUTPUTS, "bottles": 100, "signals": 50, "ledger": 50}
    sim = plant(bottle(RADIUS + 0.01, 0.0), outputs=outputs, effects={"peaks": "off", "energy_ledger": "on"})
    with Recorder(path) as recorder:
        told = OutputWriter(sim, [recorder], run_id="test")
        told.start()
        sim.command(["pushers/p/push"], [1])
        for _ in range(10):
            sim.advance()
            told.after_tick()
    return path


def test_they_are_drawn_where_they_were(bag: Path) -> None:
    """By the process image before; numbered behind the rails at rest: a gate, the pusher, a diverter."""
    with open_bag(bag) as opened, style.look():
        recording = Recording(opened)
        (frame,) = recording.frames([0.07])
        lines = draw_rails(style.new_figure(4.0, 4.0).subplots(), recording.plant.with_moving(frame.moving))
        drawn = [path.vertices for path in lines.get_paths()]
        assert opened.line.rails == ["left", "right", "gates/g", "pushers/p", "diverters/d"]
    assert len(drawn) == 5
    np.testing.assert_allclose(drawn[3][[0, -1]], [[0.06 * SPEED, -0.2], [0.06 * SPEED, 0.2]], atol=1e-6)
    np.testing.assert_allclose(drawn[4][[0, -1]], [[10.0, 0.0], [10.4, 0.0]])


def test_their_work_is_told(bag: Path) -> None:
    summary = summarize(bag)
    assert summary.energy is not None
    assert list(summary.energy.rails) == ["gates/g", "pushers/p", "diverters/d"]
    work = summary.energy.rails["pushers/p"]
    assert work > 0.05
    assert f"{work:.4g} J from rails that move" in summary.energy.sentence
    with open_bag(bag) as opened, style.look():
        recording = Recording(opened)
        assert recording.energy is not None
        figure = energy_figure(recording.energy, recording.belts)
    (curve,) = [line for ax in figure.axes for line in ax.lines if line.get_gid() == "rails that move"]
    assert float(np.asarray(curve.get_ydata())[-1]) == pytest.approx(work)
