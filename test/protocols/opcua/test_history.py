# SPDX-License-Identifier: Apache-2.0
"""Raw history of chosen tags."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone
from typing import TYPE_CHECKING, Any

from asyncua import ua
from asyncua.sync import Client
from protocols.waiting import until

from conveyor_sim.protocols.hosting.server_thread import ServerThread
from conveyor_sim.protocols.opcua.server import OpcUaServer
from conveyor_sim.protocols.tags.bag_provider import BagTagProvider
from conveyor_sim.testing.scenario import Scenario
from test.protocols.opcua.conftest import PATIENCE, refused

if TYPE_CHECKING:
    from pathlib import Path

    from test.protocols.opcua.conftest import Line

START = datetime(2000, 1, 1, tzinfo=timezone.utc)
TICK = timedelta(seconds=0.01)


def values(found: list[ua.DataValue]) -> list[tuple[Any, datetime]]:
    return [(each.Value.Value, each.SourceTimestamp) for each in found]


def test_it_is_what_the_tag_was(simulated: Line) -> None:
    node = simulated.node("belts/zone1/cmd_speed", simulated.client("test"))
    first = node.read_value()
    expected = [(first, START)]
    for value in (0.1, 0.2, 0.3):
        simulated.advance(10)
        node.write_value(value)
        simulated.advance()
        expected.append((value, START + simulated.simulation.tick * TICK))
    end = START + timedelta(days=1)
    assert values(node.read_raw_history(START, end)) == expected
    assert values(node.read_raw_history(START + 5 * TICK, START + 25 * TICK)) == expected[1:3]
    assert values(node.read_raw_history(None, end, 2)) == expected[:1:-1]
    assert values(node.read_raw_history(end, START)) == expected[::-1]
    assert values(node.read_raw_history(START, None, 3)) == expected[:3]
    assert ua.AccessLevel.HistoryRead in node.get_access_level()


def test_that_of_a_recording_is_its_own_up_to_its_place(tmp_path: Path, certificates: Path) -> None:
    """No client needs to be connected while it is recorded."""
    with Scenario("scenarios/zoned_line", bag=tmp_path / "bag") as line:
        for value in (0.1, 0.2, 0.3):
            line.run_for(0.5)
            line.command("belts/zone1/cmd_speed", value)
        line.run_for(0.5)
    with (
        BagTagProvider(tmp_path / "bag", print, paused=True) as source,
        ServerThread() as thread,
    ):
        server = OpcUaServer(source, stamps="simulated", certificates=certificates, history=["belts/zone1/cmd_speed"])
        thread.run(server.start())
        try:
            with Client(server.address, timeout=PATIENCE, watchdog_intervall=PATIENCE) as client:
                node = client.get_node("ns=2;s=belts/zone1/cmd_speed")
                end = START + timedelta(days=1)
                assert values(node.read_raw_history(START, end)) == [(0.5, START)]
                source.control("seek", 1.2, "a test")
                until(lambda: source.snapshot.tick == 120, "the place")
                expected = [(0.5, START), (0.1, START + 51 * TICK), (0.2, START + 101 * TICK)]
                assert values(node.read_raw_history(START, end)) == expected
                assert values(node.read_raw_history(end, START)) == expected[::-1]
                assert values(node.read_raw_history(START + TICK, START + 60 * TICK)) == expected[1:2]
                assert values(node.read_raw_history(START, end, 2)) == expected[:2]
        finally:
            thread.run(server.stop())


def test_others_have_none(simulated: Line) -> None:
    node = simulated.node("belts/zone2/cmd_speed", simulated.client())
    assert ua.AccessLevel.HistoryRead not in node.get_access_level()
    with refused(ua.StatusCodes.BadHistoryOperationUnsupported):
        node.read_raw_history(START, START + timedelta(days=1))
    with refused(ua.StatusCodes.BadHistoryOperationUnsupported):
        simulated.client().nodes.server.read_event_history(
            START, START + timedelta(days=1), 1, [ua.ObjectIds.BaseEventType]
        )
