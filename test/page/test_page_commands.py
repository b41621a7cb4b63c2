# SPDX-License-Identifier: Apache-2.0
"""Requests of a page are checked at once by the rules of every protocol, and refusals are on record."""

from __future__ import annotations

import math
from typing import Any, cast

import pytest
from scenes import DRIVEN_LINE

from conveyor_sim.protocols.tags.line_mirror import DrawableProvider
from conveyor_sim.protocols.tags.tag_provider import SteppedTagProvider
from conveyor_sim.protocols.web.server import PageCommands, PageUser
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

OPERATOR, TEST = PageUser("jo", "operator", "operator"), PageUser("ann", "test", "test")


@pytest.fixture
def source() -> SteppedTagProvider:
    return SteppedTagProvider(Simulation(load_scene("config/scenarios/zoned_line.yaml"), threads=1))


@pytest.mark.parametrize(
    ("person", "request_", "reason"),
    [
        (OPERATOR, {"do": "mode", "names": ["belts/zone1"], "values": [2]}, "Maintenance is not for operators"),
        (OPERATOR, {"do": "mode", "names": ["belts/zone1"], "values": [9]}, "9 given, expected 1 to 3"),
        (OPERATOR, {"do": "mode", "names": ["belts/zone1"], "values": [1.5]}, "expected a whole number"),
        (OPERATOR, {"do": "mode", "names": ["belts/zone1", "belts/zone2"], "values": [3, 2]}, "not for operators"),
        (OPERATOR, {"do": "mode", "names": ["photo_eyes/full1"], "values": [3]}, "no such device"),
        (OPERATOR, {"do": "force", "names": ["photo_eyes/full1/blocked"], "values": [0.5]}, "expected 0 or 1"),
        (TEST, {"do": "inject", "names": ["belts/zone1/trip"], "values": [7]}, "expected 0 or 1"),
        (OPERATOR, {"do": "reset_counters", "names": ["belts/zone1"]}, "no such device that counts"),
        (OPERATOR, {"do": "shelve", "names": ["x"], "values": [-1]}, "0 to 86400 s"),
    ],
)
def test_what_no_state_makes_good_is_refused_at_once(
    source: SteppedTagProvider, person: PageUser, request_: dict[str, Any], reason: str
) -> None:
    commands = PageCommands(cast(DrawableProvider, source))
    assert reason in commands.do(person, request_)
    assert (commands.writes, commands.refused) == (0, 1)
    source.before_tick()
    source._simulation.advance()
    (outcome,) = source._simulation.take_outcomes()
    assert not outcome.accepted and outcome.input.writer == f"web {person.name}"
    assert source._simulation.line.modes.modes["belts/zone1"] == 1


@pytest.mark.parametrize("value", [1e6, math.nan, -1])
def test_a_command_out_of_range_is_not_handed_on(source: SteppedTagProvider, value: float) -> None:
    commands = PageCommands(cast(DrawableProvider, source))
    assert commands.do(TEST, {"do": "set", "names": ["belts/zone1/cmd_speed"], "values": [value]})
    source.before_tick()
    source._simulation.advance()
    assert source._simulation.take_outcomes() == []


def test_a_named_drive_is_commanded_and_a_command_to_its_belt_is_refused_with_its_name() -> None:
    source = SteppedTagProvider(Simulation(load_scene(DRIVEN_LINE), threads=1))
    commands = PageCommands(cast(DrawableProvider, source))
    reason = commands.do(TEST, {"do": "set", "names": ["belts/feeder/cmd_speed"], "values": [0.1]})
    assert "drives/m1 moves this belt" in reason
    assert "drives/m1" in commands.do(OPERATOR, {"do": "mode", "names": ["belts/feeder"], "values": [3]})
    assert not commands.do(OPERATOR, {"do": "mode", "names": ["drives/m1"], "values": [3]})
    source.before_tick()
    source._simulation.advance()
    source.after_tick()
    assert not commands.do(OPERATOR, {"do": "set", "names": ["drives/m1/cmd_speed"], "values": [0.1]})
    source.before_tick()
    source._simulation.advance()
    assert source._simulation.belts().commanded.tolist() == [0.2, 0.1, 0.3]
