# SPDX-License-Identifier: Apache-2.0
"""Checks of every line in these scenarios: the guard reports nothing, and strong sustained forces are known."""

from collections.abc import Iterator

import pytest

from conveyor_sim.run.force_check import HARDER
from conveyor_sim.testing.plugin import Lines

BEYOND = {"buffer_lane", "two_stations", "zoned_line"}
"""Queues that close up: their scene files say why they press harder than their predicted error rests on."""
COARSE = {"brewery": ("overlaps", "screws block_in", "in one step")}
"""Scenes of the fast tier with words of reports that are expected.

In the brewery, bottles overlap for a moment in a combiner, and the screw squeezes or throws a bottle that comes alone.
"""


@pytest.fixture(autouse=True)
def quiet(line: Lines) -> Iterator[None]:
    """Check the lines of a test after it."""
    yield
    for scenario, _ in line.made:
        simulation, model = scenario.simulation, scenario.simulation.model
        noticed = [event.text for event in scenario._outputs.take_noticed()]
        expected = COARSE.get(scenario.scene.name, ())
        assert [text for text in noticed if not any(words in text for words in expected)] == []
        deepest = simulation.integration.deepest_overlap * float(model.type_radius.max())
        allowed = min(impact.overlap(HARDER * model.prediction.force) for impact in model.impacts)
        assert deepest <= allowed or scenario.scene.name in BEYOND | COARSE.keys()
