# SPDX-License-Identifier: Apache-2.0
"""Messages of a line to an MQTT broker: complete births, changes, and deaths of what is gone. The host checks each
message against the rules of Sparkplug 3.0 (`kit.py`).
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from datetime import datetime, timezone
from typing import TYPE_CHECKING

from conveyor_sim.line.commands.inputs import FORCE, Input
from conveyor_sim.line.run_state import ENDED, PAUSED, RUNNING, RunState
from conveyor_sim.line.tag import COMMANDS, SIGNALS
from conveyor_sim.protocols.mqtt import edge_node
from conveyor_sim.protocols.mqtt.session import BETWEEN
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation
from test.protocols.mqtt.kit import BOOLEAN, DOUBLE, SCENE, SETPOINT, SPEED, properties_of, value_of

if TYPE_CHECKING:
    from test.protocols.mqtt.kit import Line

INT32, INT64 = 3, 4


def test_births_have_every_tag_with_what_stays_the_same_of_it(line: Line) -> None:
    assert line.host.kinds() == ["NBIRTH", "DBIRTH"]
    node, device = line.host.heard
    assert node.value("bdSeq") == 0 and node.metrics["bdSeq"].datatype == INT64
    assert node.metrics["Node Control/Rebirth"].datatype == BOOLEAN and node.value("Node Control/Rebirth") is False
    assert node.value("run/state") == RUNNING and node.value("run/lost") == ""
    kinds = {"bool": BOOLEAN, "count": INT64, "enumeration": INT32, "number": DOUBLE}
    shown = [tag for tag in line.source.info.tags if tag.role in (*SIGNALS, *COMMANDS)]
    assert len(shown) > 100 and set(device.metrics) == {tag.name for tag in shown} | {"run/tick", "run/time"}
    for tag in shown:
        metric = device.metrics[tag.name]
        found = properties_of(metric)
        assert (metric.datatype, value_of(metric)) == (kinds[tag.kind], line.source.snapshot.values[tag.name]), tag.name
        assert found.pop("Quality") == 192 and metric.metadata.description == tag.description
        assert found.pop("readOnly") == (tag.role not in COMMANDS and not tag.name.endswith("/mode"))
        if tag.kind in ("number", "count"):
            unit = "" if tag.unit == "1" else tag.unit
            assert found == {"engUnit": unit, "engLow": tag.low, "engHigh": tag.high}, tag.name
    assert properties_of(device.metrics[SPEED])["engUnit"] == "m/s"
    assert properties_of(device.metrics["machines/filler/state"])["texts"].startswith("0 Undefined, 1 Clearing, ")


def test_only_what_changes_is_sent_and_all_of_it(line: Line) -> None:
    line.advance(400)
    assert set(line.host.kinds()[2:]) == {"DDATA"}
    for tag in line.source.info.tags:
        if tag.role in (*SIGNALS, *COMMANDS):
            assert line.host.values[tag.name] == line.source.snapshot.values[tag.name], tag.name
    data = line.host.heard[2:]
    before: dict[str, object] = {name: value_of(metric) for name, metric in line.host.heard[1].metrics.items()}
    for heard in data:
        for name, metric in heard.metrics.items():
            assert value_of(metric) != before[name], name
            before[name] = value_of(metric)


def test_numbers_go_round(line: Line) -> None:
    """The host holds each against the one before."""
    for count in range(300):
        line.source.show(forced=frozenset() if count % 2 else frozenset({SPEED}))
        if count % 50 == 0:
            line.until(lambda: len(line.host.heard) >= count, "what was said")  # noqa: B023
    line.until(lambda: len(line.host.heard) >= 302, "all")
    assert {heard.payload.seq for heard in line.host.heard} == set(range(256))


def test_how_time_passes_is_said_with_what_changes_or_now_and_then(line: Line) -> None:
    for _ in range(10):
        line.advance(5)
    told = [heard for heard in line.host.heard if heard.kind == "DDATA"]
    clocks = {"run/tick", "run/time", "machines/packer/starved_time", "machines/filler/blocked_time"}
    passing = [heard for heard in told if set(heard.metrics) <= clocks]
    stamps = [heard.payload.timestamp for heard in told]
    assert passing and told[-1].value("run/tick") == 50 and len(told) < 50
    for before, heard in zip(stamps, told[1:], strict=False):
        assert heard not in passing or heard.payload.timestamp - before >= 1e3 * BETWEEN - 2  # ms, of two clocks


def test_times_are_those_of_the_scene_on_request(serve: Callable[..., Line]) -> None:
    line = serve(stamps="simulated")
    line.advance(100)
    start = datetime.fromisoformat(line.source.info.start_time.replace("Z", "+00:00"))
    assert line.host.last("DDATA").metrics["run/tick"].timestamp == int(start.timestamp() * 1000) + 1000
    assert line.host.last("DDATA").payload.timestamp > datetime(2026, 1, 1, tzinfo=timezone.utc).timestamp() * 1000


def test_a_signal_that_is_forced_says_so(line: Line) -> None:
    eye = "photo_eyes/full1/blocked"
    line.simulation.give(Input("operate", "Jo", "operator", FORCE, (eye,), (1.0,)))
    line.advance()
    assert line.host.values[eye] is True and line.host.forced == {eye}
    line.simulation.give(Input("operate", "Jo", "operator", "unforce", (eye,), ()))
    line.advance()
    assert line.host.values[eye] is False and not line.host.forced
    assert properties_of(line.host.last("DDATA").metrics[eye]) == {"forced": False}


def test_what_stands_is_stale_until_it_goes_on(line: Line) -> None:
    line.advance()
    line.source.show(run=RunState(PAUSED))
    line.until(lambda: line.host.values["run/state"] == PAUSED, "the pause")
    device = [name for name in line.host.qualities if name in line.host.heard[1].metrics]
    assert {line.host.qualities[name] for name in device} == {500}
    line.advance()
    assert {line.host.qualities[name] for name in device} == {192}
    assert all(properties_of(metric)["Quality"] == 192 for metric in line.host.last("DDATA").metrics.values())


def test_a_line_that_is_lost_is_dead_until_it_is_back(line: Line) -> None:
    line.advance(5)
    line.source.show(lost="the cable is cut")
    line.until(lambda: line.host.values["run/lost"] == "the cable is cut", "the loss")
    assert line.host.alive == {"node": True, "line": False} and "DDEATH" in line.host.kinds()
    line.host.rebirth()
    line.until(lambda: line.host.kinds().count("NBIRTH") == 2, "births")
    line.advance()
    line.until(lambda: line.host.values["run/lost"] == "", "its being back")
    assert line.host.alive["line"]
    assert line.host.kinds().count("DBIRTH") == 2  # the rebirth had none


def test_a_run_that_has_ended_tells_its_last_values_and_dies(line: Line) -> None:
    line.advance(10)
    line.source.run = RunState(ENDED)
    line.source.before_tick()
    line.simulation.advance()
    line.source.after_tick()
    line.until(lambda: not line.host.alive["line"], "its death")
    assert line.host.values["run/tick"] == 11
    line.until(lambda: line.host.values["run/state"] == ENDED, "the end")


def test_where_time_steps_back_all_is_said_again(line: Line) -> None:
    line.advance(50)
    line.source._simulation = Simulation(load_scene(SCENE), threads=1)
    line.advance()
    assert line.host.last("DBIRTH").value("run/tick") == 1 and line.host.kinds().count("DBIRTH") == 2
    for name, value in line.source.snapshot.values.items():
        assert line.host.values[name] == value, name


def test_a_host_that_comes_late_asks_for_births(line: Line) -> None:
    line.advance(20)
    line.host.rebirth()
    line.until(lambda: line.host.kinds().count("NBIRTH") == 2, "births")
    line.until(lambda: line.host.kinds()[-2:] == ["NBIRTH", "DBIRTH"], "that of the line")
    again = line.host.last("NBIRTH")
    assert (again.payload.seq, again.value("bdSeq")) == (0, 0)
    assert line.host.last("DBIRTH").value("run/tick") == 20
    line.advance()


def test_who_asks_for_births_again_and_again_gets_them_now_and_then(line: Line) -> None:
    began = time.monotonic()
    for births in (2, 3):
        for _ in range(100):
            line.host.rebirth()
        line.until(lambda: line.host.kinds().count("NBIRTH") >= births, "births")  # noqa: B023
    line.advance()
    seconds = time.monotonic() - began
    assert line.host.kinds().count("NBIRTH") <= 2 + seconds / edge_node.BIRTHS_EVERY


def test_nothing_is_sent_without_the_primary_host(serve: Callable[..., Line]) -> None:
    line = serve(primary_host="scada1", wait=False)
    line.until(lambda: line.node.status().state == "waits for host scada1", "the connection")
    line.host.state(False, 10)
    line.host._client.publish("spBv1.0/STATE/scada1", b"\xff{", qos=1, retain=True)
    line.source.after_tick()
    assert line.host.kinds() == []
    line.host.state(True, 20)
    line.until(lambda: line.host.alive["line"], "births")
    line.host.state(False, 19)  # an old death
    line.advance()
    assert line.host.alive["line"]
    line.host.state(False, 20)
    line.until(lambda: not line.host.alive["node"], "a death")
    line.host.state(True, 30)
    line.until(lambda: line.host.alive["line"], "births again")
    assert line.host.last("NBIRTH").value("bdSeq") == 1


def test_it_says_good_bye(line: Line) -> None:
    line.stop()
    line.until(lambda: not line.host.alive["node"], "a death")
    assert line.host.last("NDEATH").value("bdSeq") == 0


def test_everything_comes_back_when_the_broker_does(line: Line) -> None:
    line.advance(3)
    line.broker.kill()
    line.until(lambda: line.node.status().state.startswith("not connected"), "the loss")
    assert line.node.status().clients == 0
    for _ in range(300):
        line.source.before_tick()
        line.simulation.advance()
        line.source.after_tick()
    line.broker.start()
    line.until(lambda: line.host.subscribed and line.node.status().state == "connected", "both")
    line.host.rebirth()  # as a host does that was away: the line may have been there first
    line.until(lambda: line.host.last("NBIRTH").value("bdSeq") >= 1 and line.host.alive["line"], "births")
    line.advance()
    assert line.host.values[SETPOINT] == line.source.snapshot.values[SETPOINT]
    assert line.node.status().state == "connected"


def test_a_broker_that_stands_still_holds_up_nothing_and_is_told_the_newest(line: Line) -> None:
    """Late messages are left out, and the host finds no gap in the numbers."""
    assert line.broker.process is not None
    os.kill(line.broker.process.pid, signal.SIGSTOP)
    left_out = 0
    try:
        while left_out < 100:
            line.source.before_tick()
            line.simulation.advance()
            line.source.after_tick()
            left_out = line.node.status().left_out
    finally:
        os.kill(line.broker.process.pid, signal.SIGCONT)
    line.advance()
    for name, value in line.source.snapshot.values.items():
        assert line.host.values[name] == value, name
