# SPDX-License-Identifier: Apache-2.0
"""Named drives over Modbus: rows of the drive, and of its belts the two that can be read."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from protocols.modbus.modbus_line import Line, serving
from scenes import DRIVEN_LINE


@pytest.fixture(scope="module")
def driven() -> Iterator[Line]:
    with serving("controller", DRIVEN_LINE) as line:
        yield line


def test_a_write_to_the_drive_moves_its_belts(driven: Line) -> None:
    assert not driven.write("drives/m1/cmd_speed", 0.25).isError()
    driven.advance_until(lambda: driven.read("belts/feeder/speed") == 0.5, "the speed")
    assert driven.read("drives/m1/speed") == driven.read("belts/table/speed") == 0.25
    assert not driven.write("drives/m1/run", 0.0).isError()
    driven.advance_until(lambda: driven.read("belts/feeder/speed") == 0.0, "a stop")


def test_the_map_has_the_rows_of_the_drive_and_no_setpoint_of_its_belts(driven: Line) -> None:
    names = set(driven.rows)
    assert {f"drives/m1/{name}" for name in ("speed", "running", "at_speed", "fault", "pulses", "mode")} <= names
    assert {name for name in names if name.startswith("belts/feeder")} == {
        "belts/feeder/speed",
        "belts/feeder/bottles",
    }
