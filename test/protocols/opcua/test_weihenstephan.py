# SPDX-License-Identifier: Apache-2.0
"""Machines by the names of the Weihenstephan Standards."""

from __future__ import annotations

from typing import TYPE_CHECKING

from asyncua import ua

from conveyor_sim.line.machines.weihenstephan import BY_ITSELF, PRODUCTION, STATE_TEXTS, data_points

if TYPE_CHECKING:
    from test.protocols.opcua.conftest import Line

POINTS = "machines/filler/Weihenstephan"


def shown(line: Line) -> dict[str, float]:
    object_ = line.node(POINTS)
    return {child.read_browse_name().Name: child.read_value() for child in object_.get_children()}


def test_data_points_are_those_of_the_line(line: Line) -> None:
    line.advance(300)
    found = shown(line)
    tags = {tag.name: tag for tag in line.source.info.tags}
    assert found == data_points("machines/filler", tags, line.source.snapshot.values)
    assert found["WS_Cur_Mode"] == BY_ITSELF and found["WS_Cur_Prog"] == PRODUCTION
    assert STATE_TEXTS[int(found["WS_Cur_State"])] == "Operating"
    assert found["WS_Tot_Containers"] > 0
    assert line.node(f"{POINTS}/WS_Cur_State").read_data_type_as_variant_type() is ua.VariantType.UInt32


def test_they_follow_what_is_done_to_the_machine(line: Line) -> None:
    line.simulation.inject("machines/filler/stop", 1.0)
    line.advance(3)
    found = shown(line)
    assert STATE_TEXTS[int(found["WS_Cur_State"])] == "Equipment failure"
    assert found["WS_Not_Of_Fail_Code"] == line.source.snapshot.values["machines/filler/stop_reason"] > 0
    assert found["WS_Cur_Mach_Spd"] == 0.0 < found["WS_Set_Mach_Spd"]
    assert found["WS_Cur_Mode"] == BY_ITSELF  # it has failed, nobody has taken it in hand
