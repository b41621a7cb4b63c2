# SPDX-License-Identifier: Apache-2.0
"""Every scene that is shipped or shown runs without the guard's remark, within the forces its prediction rests on."""

from pathlib import Path

import pytest
from scenes import SHARED_KERNELS, SHIPPED, shipped_name

from conveyor_sim.run.force_check import HARDER, PeakWatch, achieved
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

SECONDS = {
    **dict.fromkeys(("buffer_lane", "two_stations"), 30.0),
    **dict.fromkeys(("reject_line", "watched_eyes", "zoned_line"), 60.0),
    "filler_block": 20.0,
    "panel_line": 5.0,  # stands until an operator starts it
}
"""Of those that go on as they are then."""
FAST = {"brewery"}
"""Scenes of the fast tier, which predicts no forces. Tests of control run them (test/control/st/test_brewery.py)."""
BEYOND = {"buffer_lane", "two_stations"}
"""Scenes that press harder than expected, and say why."""
WORDS = "more than its predicted error rests on"
"""With which they say so."""


@pytest.mark.parametrize("path", [path for path in SHIPPED if shipped_name(path) not in FAST], ids=shipped_name)
def test_it_runs_as_its_prediction_expects(path: Path) -> None:
    name = shipped_name(path)
    # Effects as the scene has them, or more where other scenes have the same kernels with them.
    scene = load_scene(path, SHARED_KERNELS.get(name, {}))
    simulation = Simulation(scene, threads=1)
    peaks = PeakWatch(simulation)
    for _ in range(round(min(SECONDS.get(name, scene.duration), scene.duration) / scene.tick)):
        simulation.advance()
        peaks.after_tick()
    assert [event.text for event in simulation.take_events().guard] == []
    model = simulation.model
    reached = achieved(model, peaks.force)
    if reached is None:
        # The guard's look at overlaps, some hundred times a second, has to do.
        deepest = simulation.integration.deepest_overlap * float(model.type_radius.max())
        allowed = min((impact.overlap(HARDER * model.prediction.force) for impact in model.impacts), default=0.0)
        assert deepest <= allowed
        return
    assert reached.as_expected is (name not in BEYOND), reached.sentence
    assert reached.as_expected or WORDS in path.read_text()


def test_the_scenes_are_found() -> None:
    assert {"paper_plant", "zoned_line", "push", "glass_line_1e7", "table"} <= {shipped_name(path) for path in SHIPPED}
    assert len(SHIPPED) >= 17
