# SPDX-License-Identifier: Apache-2.0
"""Named drives over OPC UA: nodes, writes, mode and faults of the drive; its belts can only be read."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from asyncua import ua
from scenes import DRIVEN_LINE

from test.protocols.opcua.conftest import refused

if TYPE_CHECKING:
    from test.protocols.opcua.conftest import Line, Serve

Codes = ua.StatusCodes
SPEED = "drives/m1/cmd_speed"


@pytest.fixture(scope="module")
def driven(serve: Serve) -> Line:
    return serve(DRIVEN_LINE)


def test_a_write_to_the_drive_moves_its_belts(driven: Line) -> None:
    controller = driven.client("controller")
    driven.node(SPEED, controller).write_value(0.3)
    driven.advance(30)
    assert driven.outcomes() == [("opcua controller", "set", (SPEED,), (0.3,), True)]
    for name, speed in (("drives/m1", 0.3), ("belts/feeder", 0.6), ("belts/table", 0.3), ("belts/exit", 0.3)):
        assert driven.read(f"{name}/speed") == pytest.approx(speed)
    assert driven.read(f"{SPEED}/written_by") == "controller opcua controller"
    with refused(Codes.BadOutOfRange):
        driven.node(SPEED, controller).write_value(0.6)


def test_its_belts_have_no_setpoint_and_no_mode(driven: Line) -> None:
    controller = driven.client("controller")
    assert {child.nodeid.Identifier for child in driven.node("belts/feeder").get_children()} == {
        "belts/feeder/speed",
        "belts/feeder/bottles",
    }
    with refused(Codes.BadNodeIdUnknown):
        driven.node("belts/feeder/cmd_speed", controller).write_value(0.1)
    with refused(Codes.BadNotWritable):
        driven.node("belts/feeder/speed", controller).write_value(0.1)


def test_the_mode_and_the_fault_belong_to_the_drive(driven: Line) -> None:
    engineer, tester = driven.client("engineer"), driven.client("test")
    driven.node("line", engineer).call_method("2:set_mode", "drives/m1", ua.Variant(3, ua.VariantType.UInt32))
    driven.advance()
    assert driven.read("drives/m1/mode") == 3
    driven.node("line", tester).call_method("2:inject", "drives/m1/trip", 1.0)
    driven.advance(60)
    assert driven.read("drives/m1/fault") is True
    assert driven.read("belts/feeder/speed") == driven.read("belts/table/speed") == 0.0
