# SPDX-License-Identifier: Apache-2.0
"""Recordings of the node. Every end leaves a readable bag."""

from __future__ import annotations

import resource
from collections.abc import Callable
from pathlib import Path
from typing import Any

from conveyor_msgs.msg import Bottles, Contacts
from diagnostic_msgs.msg import DiagnosticStatus
from ros.line_client import LineClient, until
from std_srvs.srv import Trigger

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recover import recover
from conveyor_sim.bag.replay import replay
from conveyor_sim.ros.child import Child

FEEDER = "belts/feeder/cmd_speed"


def messages(bag: Path) -> dict[str, list[tuple[int, bytes]]]:
    """Stamps and bytes by topic, without the line, which holds the run's name."""
    found: dict[str, list[tuple[int, bytes]]] = {}
    with open_bag(bag) as opened:
        for topic, stamp, data in opened.raw():
            if topic != "line":
                found.setdefault(topic, []).append((stamp, bytes(data)))
    return found


def scans(client: LineClient) -> list[int]:
    """State hashes of a few scans with commands, a bad one among them."""
    hashes = []
    for number, speed in enumerate((0.25, 0.75, 99.0, 0.5)):
        response = client.lockstep(50 * (number + 1), names=[FEEDER], values=[speed], release=number == 3)
        assert response.accepted
        hashes.append(response.state_hash)
    return hashes


def test_an_interrupted_node_leaves_a_whole_bag(
    start_node: Callable[..., Child], client: LineClient, tmp_path: Path
) -> None:
    node = start_node(record=tmp_path / "bag", duration=1000.0)
    client.call(Trigger, "resume")
    until(lambda: client.lockstep(0).tick > 100, "100 ticks")
    node.stop()
    assert node.exit_code == 0
    recorded = messages(tmp_path / "bag")
    assert len(recorded["bottles"]) > 50
    assert recover(tmp_path / "bag").healthy


def test_state_is_the_same_with_and_without_subscribers_and_recorder(
    start_node: Callable[..., Child], client: LineClient, tmp_path: Path
) -> None:
    node = start_node()
    alone = scans(client)
    node.stop()
    node = start_node(record=tmp_path / "bag")
    with client.listen(Bottles, "bottles"), client.listen(Contacts, "contacts"):
        watched = scans(client)
    node.stop()
    assert watched == alone
    report = replay(tmp_path / "bag")
    assert report.difference is None
    assert report.last_tick == 200


def test_a_reset_closes_the_bag_and_opens_the_next(
    start_node: Callable[..., Child], client: LineClient, tmp_path: Path
) -> None:
    node = start_node(record=tmp_path / "bag")
    scans(client)
    client.reset()
    first = messages(tmp_path / "bag")  # whole while the next is being recorded
    scans(client)
    client.reset()
    client.reset()
    node.stop()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bag", "bag_1", "bag_2", "bag_3"]
    assert messages(tmp_path / "bag_1") == first
    with open_bag(tmp_path / "bag") as one, open_bag(tmp_path / "bag_1") as two:
        assert one.line.run_id != two.line.run_id


def test_at_the_end_of_the_run_the_bag_is_whole_while_the_node_lives_on(
    start_node: Callable[..., Child], client: LineClient, tmp_path: Path
) -> None:
    node = start_node(record=tmp_path / "bag", start_paused=False, duration=1.0, **{"rates.bottles": 10.0})
    until(lambda: "the run has ended at tick 100" in client.lockstep(0).reason, "the end of the run")
    recorded = messages(tmp_path / "bag")
    assert len(recorded["bottles"]) == 11
    assert len(recorded["signals"]) == 101
    assert node.exit_code is None
    node.stop()


def test_a_full_disk_pauses_with_an_error_and_leaves_what_was_written(
    start_node: Callable[..., Child], client: LineClient, tmp_path: Path
) -> None:
    node = start_node(record=tmp_path / "bag", duration=1000.0)
    resource.prlimit(node.pid, resource.RLIMIT_FSIZE, (2**20, 2**20))  # no file of the node may be larger
    client.call(Trigger, "resume")

    def failed() -> Any:
        status, values = client.diagnostics()
        return (status, values) if status.level == DiagnosticStatus.ERROR else None

    status, values = until(failed, "an error")
    assert values["state"] == "PAUSED"
    assert f"stopped: {tmp_path / 'bag'}: recording stopped at" in status.message
    resumed = client.call(Trigger, "resume")
    assert not resumed.success
    assert "expected a reset" in resumed.message
    client.reset()
    status, _ = client.diagnostics()
    assert status.level == DiagnosticStatus.OK
    node.stop()
    assert node.exit_code == 0
    recover(tmp_path / "bag")
    assert messages(tmp_path / "bag")["bottles"]
