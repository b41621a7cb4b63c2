# SPDX-License-Identifier: Apache-2.0
"""OEE that a SCADA system computes from PackML's `Admin`, compared with the counters of the line."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from test.protocols.opcua.node_session import NodeSession, needs_node_opcua, node_session

if TYPE_CHECKING:
    from pathlib import Path

    from test.protocols.opcua.conftest import Line

pytestmark = needs_node_opcua


def of_scada(session: NodeSession, machine: str) -> tuple[float, float]:
    """Return the OEE of a machine from OPC UA alone, as docs/opcua.md states it, and what one bottle adds to it."""
    packml = f"machines/{machine}/PackML"

    def count(name: str) -> int:
        return int(session.read(f"{packml}.Admin.{name}")["value"][0]["count"])

    seconds = session.read(f"{packml}.Admin.AccTimeSinceReset")["value"]
    fastest = session.read(f"{packml}.Status.MachSpeed.EURange")["value"]["high"]
    defective = count("ProdDefectiveCount") if machine == "packer" else 0
    possible = fastest * seconds / 60.0
    return (count("ProdProcessedCount") - defective) / possible, 1.0 / possible


def test_the_oee_of_a_scada_system_is_that_of_the_line(line: Line, tmp_path: Path) -> None:
    line.client()
    line.advance(1500)
    line.simulation.inject("machines/filler/stop", 1.0)
    line.advance(500)
    line.simulation.inject("machines/filler/stop", 0.0)
    line.advance(1000)
    counters = line.simulation.line.counters()
    assert counters is not None
    with node_session(line.server.address, tmp_path) as session:
        for machine in ("filler", "packer"):
            place = list(counters.name).index(f"machines/{machine}")
            oee, one_bottle = of_scada(session, machine)
            assert 0.3 < oee < 0.9 or machine == "packer"
            # The counters include the part of the present cycle that is complete.
            assert oee == pytest.approx(float(np.nan_to_num(counters.oee[place])), abs=1.01 * one_bottle)
            times = session.read(f"machines/{machine}/PackML.Admin.StateCumulativeTime")["value"]
            assert abs(sum(times) - 30) <= sum(time > 0 for time in times)  # each is rounded down
