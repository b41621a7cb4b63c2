# SPDX-License-Identifier: Apache-2.0
"""The operator panel of a line under test: actions, their errors, and programs that can't press."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from facts import missing

from conveyor_sim.control.scan import ControlError
from conveyor_sim.control.st import StructuredText
from conveyor_sim.errors import CommandError
from conveyor_sim.protocols.attach.tag_map import TagMapError, read_tag_map
from conveyor_sim.testing import Scenario

PRESSES = """
PROGRAM presses
VAR_OUTPUT
  {tag: panel/start/press}
  press : BOOL;
END_VAR
press := TRUE;
END_PROGRAM
"""


@pytest.fixture(scope="module")
def plant() -> Scenario:
    return Scenario("scenarios/panel_line")


def test_actions_act_at_the_next_tick(plant: Scenario) -> None:
    plant.panel.press("start")
    plant.panel.release("start")
    plant.panel.turn("mode", 0)
    plant.panel.set("speed", 0.45)
    plant.panel.press("estop")
    assert plant.signals["panel/start/contact"] == 0.0
    plant.run_for(0.01)
    present = plant.signals
    assert [
        present[f"panel/{name}"] for name in ("start/contact", "mode/position", "speed/value", "estop/contact")
    ] == [
        1.0,
        0.0,
        0.45,
        0.0,
    ]
    plant.panel.turn("mode", "auto")
    plant.panel.reset("estop")
    plant.run_for(0.01)
    present = plant.signals
    assert [present[f"panel/{name}"] for name in ("start/contact", "mode/position", "estop/contact")] == [0.0, 1.0, 1.0]


@pytest.mark.parametrize(
    ("act", "facts"),
    [
        (lambda panel: panel.press("strat"), ["press strat", "start", "estop"]),
        (lambda panel: panel.press("ready"), ["press ready", "start"]),
        (lambda panel: panel.release("estop"), ["release estop", "start"]),
        (lambda panel: panel.turn("mode", "on"), ["turn mode", "on given", "off", "auto"]),
        (lambda panel: panel.turn("mode", 0.5), ["turn mode", "0.5 given", "off"]),
        (lambda panel: panel.turn("mode", True), ["turn mode", "True given"]),
        (lambda panel: panel.set("speed", "fast"), ["set speed", "fast given", "0.1 to 0.5 m/s"]),
        (lambda panel: panel.set("speed", float("nan")), ["set speed", "nan given"]),
        (lambda panel: panel.set("speed", [0.3]), ["set speed", "[0.3] given"]),
        (lambda panel: panel.set("made", 3), ["set made", "speed"]),
        (lambda panel: panel.reset("start"), ["reset start", "estop"]),
    ],
    ids=range(11),
)
def test_a_wrong_action_is_refused_at_once(act: Callable[[Any], None], facts: list[str], plant: Scenario) -> None:
    with pytest.raises(CommandError) as refused:
        act(plant.panel)
    assert missing(str(refused.value), *facts) == []


def test_a_program_with_an_output_to_an_input_of_the_panel_is_refused(plant: Scenario, tmp_path: Path) -> None:
    program = tmp_path / "presses.st"
    program.write_text(PRESSES)
    with pytest.raises(ControlError) as refused:
        plant.attach(StructuredText(program))
    assert missing(str(refused.value), "panel/start/press") == []


def test_a_map_of_a_plc_with_an_input_of_the_panel_is_refused(plant: Scenario, tmp_path: Path) -> None:
    tags = tmp_path / "tags.csv"
    tags.write_text("tag,theirs\npanel/start/press,coil 0 bool\n")
    with pytest.raises(TagMapError) as refused:
        read_tag_map(tags, plant.simulation.process_image.tags)
    assert missing(str(refused.value), f"{tags}: line 2", "panel/start/press", "input of the panel", "operators") == []
