# SPDX-License-Identifier: Apache-2.0
"""More commands than there is room for, larger ones, and what no command is: bounded, refused, counted."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from conveyor_msgs import srv
from conveyor_msgs.msg import CommandOutcome, Commands
from facts import missing
from ros.line_client import LineClient, until
from std_msgs.msg import Float64

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.ros.child import Child
from conveyor_sim.run.inbox import MESSAGE_BYTES, MOST_WAITING

FEEDER = "belts/feeder/cmd_speed"
GOOD = Commands(names=[FEEDER], values=[0.25])
STUCK = "photo_eyes/entry/stuck_on"


def resident(process: int) -> int:
    """Bytes of memory that a process has now."""
    return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def counts(line: LineClient) -> dict[str, int]:
    """Return the numbers of commands in diagnostics: received, applied, refused, lost, waiting."""
    _, values = line.diagnostics()
    return {name.removesuffix(" commands"): int(values[name]) for name in values if name.endswith(" commands")}


def change(line: LineClient, before: dict[str, int], expected: dict[str, int]) -> None:
    """Wait until the counts have changed so, and nothing else about them."""

    def changed() -> dict[str, int]:
        now = counts(line)
        return {name: now[name] - before[name] for name in now if now[name] != before[name]}

    last: list[dict[str, int]] = []
    end = time.monotonic() + 30.0
    while not last or (last[-1] != expected and time.monotonic() < end):
        last.append(changed())
    assert last[-1] == expected


@pytest.fixture
def outcomes(line: LineClient) -> Any:
    with line.listen(CommandOutcome, "outcomes") as heard:
        time.sleep(0.3)  # until the node knows, too
        yield heard.messages


@pytest.fixture
def commands(line: LineClient) -> Any:
    publisher = line.publisher(Commands, "commands", "commands")
    yield publisher
    line.between_callbacks(lambda: line.node.destroy_publisher(publisher))


def told(outcomes: list[Any], words: str) -> list[Any]:
    """Outcomes that tell of many commands, with these words."""
    return [outcome for outcome in outcomes if outcome.source == "arrival" and words in outcome.reason]


def publish_slowly(line: LineClient, publisher: Any, message: Any, count: int) -> None:
    """So that DDS loses none, however long the node waits for a core."""
    for number in range(1, count + 1):
        publisher.publish(message)
        if number % 10 == 0:
            line.lockstep(0, run_id="look")  # refused; the node has taken by then what was sent before


def test_the_queue_of_a_paused_simulation_is_bounded_by_count(
    line: LineClient, commands: Any, outcomes: list[Any]
) -> None:
    before = counts(line)
    sent = MOST_WAITING + 300
    publish_slowly(line, commands, GOOD, sent)
    change(line, before, {"received": sent, "refused": 300, "waiting": MOST_WAITING})
    refused = sum(int(outcome.reason.split()[0]) for outcome in told(outcomes, "from commands refused: the queue was"))
    assert refused == 300
    assert len(outcomes) < 10
    fault = line.call(srv.InjectFault, "inject_fault", name=STUCK, value=1.0)
    assert (fault.success, "the queue was full" in fault.message) == (False, True)
    line.step()
    change(line, before, {"received": sent, "refused": 300, "applied": MOST_WAITING})
    assert line.call(srv.InjectFault, "inject_fault", name=STUCK, value=0.0).success


def test_large_commands_take_little_memory(line: LineClient, shared_node: Child, commands: Any) -> None:
    """An earlier version took 1 GB for these 120 messages of 100 000 names."""
    large = Commands(names=[f"belts/{number}/cmd_speed" for number in range(100_000)], values=[0.0] * 100_000)
    before, memory = counts(line), resident(shared_node.pid)
    for _ in range(120):
        commands.publish(large)
        time.sleep(0.01)
    until(lambda: (now := counts(line))["received"] + now["lost"] - before["received"] - before["lost"] >= 120, "all")
    assert counts(line)["waiting"] == 0
    assert resident(shared_node.pid) - memory < 500e6  # what DDS keeps of them, a hundred messages


def test_the_queue_is_bounded_by_bytes(line: LineClient, commands: Any) -> None:
    names = ["x" * 100] * 2000
    before = counts(line)
    publish_slowly(line, commands, Commands(names=names, values=[0.0] * 2000), 40)
    until(lambda: counts(line)["received"] - before["received"] == 40, "all of them")
    _, values = line.diagnostics()
    assert MESSAGE_BYTES * 10 < int(values["waiting commands (bytes)"]) <= 4 * 1024 * 1024
    assert 0 < int(values["waiting commands"]) < 40
    line.reset()
    assert counts(line)["waiting"] == 0


@pytest.mark.parametrize("data", [b"\0", b"\0\1\0\0", b"\xff" * 77, b"\0\1\0\0" + b"\xff" * 4000], ids=len)
def test_what_is_no_message_is_refused_and_counted(
    line: LineClient, commands: Any, outcomes: list[Any], data: bytes
) -> None:
    before = counts(line)
    for _ in range(5):
        commands.publish(data)
    change(line, before, {"received": 5, "refused": 5})
    assert until(lambda: told(outcomes, "not readable as conveyor_msgs/Commands"), "its outcome")


def test_what_dds_lost_is_counted_to_the_last_one(line: LineClient, commands: Any, outcomes: list[Any]) -> None:
    """30 000 commands at 8 kHz: none is without an account."""
    before, sent = counts(line), 30_001
    commands.publish(GOOD)  # from the first one that it receives of a publisher, the node sees what is missing
    until(lambda: counts(line)["received"] > before["received"], "the first one")
    begin = time.monotonic()
    for number in range(0, sent - 1, 20):
        for _ in range(20):
            commands.publish(GOOD)
        time.sleep(max(0.0, begin + number / 8000.0 - time.monotonic()))

    def all_known() -> bool:
        now = counts(line)
        return now["received"] + now["lost"] - before["received"] - before["lost"] == sent

    until(all_known, "an account of every command")
    line.step()
    now = {name: count - before[name] for name, count in counts(line).items()}
    assert now["lost"] > 0
    assert now["received"] == now["applied"] + now["refused"]
    assert now["applied"] <= MOST_WAITING
    lost = sum(int(outcome.reason.split()[0]) for outcome in told(outcomes, "from commands lost on the way"))
    assert lost == now["lost"]


def test_what_waits_is_refused_by_a_reset(line: LineClient, commands: Any, outcomes: list[Any]) -> None:
    before = counts(line)
    commands.publish(GOOD)
    change(line, before, {"received": 1, "waiting": 1})
    line.reset()
    change(line, before, {"received": 1, "refused": 1})
    (outcome,) = outcomes
    assert (list(outcome.names), outcome.accepted, outcome.reason) == ([FEEDER], False, "the simulation was reset")


def test_a_message_that_says_nothing_is_refused(line: LineClient, commands: Any, outcomes: list[Any]) -> None:
    before = counts(line)
    commands.publish(Commands())
    change(line, before, {"received": 1, "waiting": 1})
    line.step()
    until(lambda: outcomes, "its outcome")
    assert not outcomes[0].accepted
    assert missing(outcomes[0].reason, ["no name", "no value", "at least one command"]) == []


def test_refusals_do_not_flood_the_log(line: LineClient, shared_node: Child, commands: Any) -> None:
    """A line break in a name does not make a separate line."""
    before, begin = counts(line), len(shared_node.log.read_text())
    forged = Commands(names=["x\n[ERROR] [conveyor_sim]: forged\x1b[31m" + "y" * 5000], values=[1.0])
    publish_slowly(line, commands, forged, 500)
    change(line, before, {"received": 500, "waiting": 500})
    line.step()
    sentence = "490 more commands were refused; each command result has the reason"
    until(lambda: sentence in shared_node.log.read_text(), "a last line")
    lines = shared_node.log.read_text()[begin:].splitlines()
    assert sum("refused at tick" in line for line in lines) == 10
    assert not any(line.startswith("[ERROR]") for line in lines)
    assert max(map(len, lines)) < 1000
    assert "\x1b[31m" not in shared_node.log.read_text()[begin:]


def test_a_recording_with_a_flood_is_replayed(
    start_node: Callable[..., Child], shared_node: Child, client: LineClient, tmp_path: Path
) -> None:
    shared_node.stop()
    node = start_node(record=tmp_path / "bag", duration=1000.0)
    commands = client.publisher(Commands, "commands", "commands")
    speed = client.publisher(Float64, FEEDER, "cmd_speed")
    client.step(3)
    publish_slowly(client, commands, GOOD, MOST_WAITING + 100)
    publish_slowly(client, commands, b"\xff" * 9, 3)
    speed.publish(Float64(data=7.0))
    until(lambda: sum(counts(client)[name] for name in ("refused", "waiting")) == MOST_WAITING + 104, "the account")
    client.step(20)
    node.stop()
    with open_bag(tmp_path / "bag") as bag:
        sources = [frame.data.source for frame in bag.outcomes()]
    assert sources.count("arrival") >= 2
    report = replay(tmp_path / "bag")
    assert (report.difference, report.last_tick) == (None, 23)
