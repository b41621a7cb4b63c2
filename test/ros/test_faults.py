# SPDX-License-Identifier: Apache-2.0
"""The service inject_fault, over DDS: what it does is recorded, told, and replayed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from conveyor_msgs import srv
from conveyor_msgs.msg import CommandOutcome, Line
from ros.line_client import LineClient, until

from conveyor_sim.bag.replay import replay
from conveyor_sim.ros.child import Child

STUCK = "photo_eyes/entry/stuck_on"


def inject(client: LineClient, name: str, value: float) -> Any:
    """The response."""
    return client.call(srv.InjectFault, "inject_fault", name=name, value=value)


def test_a_fault_acts_at_the_next_tick_and_is_replayed(
    start_node: Callable[..., Child], client: LineClient, tmp_path: Path
) -> None:
    node = start_node(record=tmp_path / "bag")
    client.step(10)
    with client.listen(Line, "line") as lines, client.listen(CommandOutcome, "outcomes") as outcomes:
        line = lines.first()
        assert STUCK in line.fault_names
        assert {tag.name: tag.kind for tag in line.tags}[STUCK] == "bool"
        injected = inject(client, STUCK, 1.0)
        assert (injected.success, injected.message, injected.tick) == (True, "", 10)
        for name, value, says in (
            (STUCK, 0.5, f"{STUCK}: 0.5 given, expected 0 or 1"),
            ("belts/feeder/cmd_speed", 0.5, "belts/feeder/cmd_speed: no such fault, expected one of "),
        ):
            refused = inject(client, name, value)
            assert not refused.success
            assert refused.message.startswith(says)
        client.step(10)
        until(lambda: outcomes.messages, "the outcome of the fault")
        (outcome,) = outcomes.messages
        assert (outcome.tick, outcome.source, list(outcome.names), outcome.accepted) == (10, "fault", [STUCK], True)
    node.stop()
    report = replay(tmp_path / "bag")
    assert (report.difference, report.compared["outcomes"]) == (None, 1)
