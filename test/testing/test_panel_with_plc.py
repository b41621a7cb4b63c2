# SPDX-License-Identifier: Apache-2.0
"""An operator panel while a PLC in lockstep commands the line: an emergency stop, and a user who acts at any moment."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from testing.plc_servers import KINDS, OWN, program, write_map
from testing.soft_plc import BOTTLES, SETPOINT

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.control.scan import Inputs
from conveyor_sim.line.commands.inputs import SET, Input
from conveyor_sim.protocols.hosting.server_thread import ServerThread
from conveyor_sim.testing.scenario import Scenario

pytest.importorskip("pymodbus", reason="pymodbus is not installed: pip install conveyor-sim[scada]")

LINE = "scenarios/panel_line"
ON_LANE, SPEED = "belts/lane/bottles", "belts/lane/cmd_speed"


def test_power_wins_over_a_plc_and_the_recording_replays(tmp_path: Path) -> None:
    thread, made = ServerThread(), KINDS["modbus"]()
    places = {BOTTLES: "belts/lane/bottles", SETPOINT: "belts/lane/cmd_speed"}
    tags = write_map(tmp_path / "tags.csv", {places.get(ours, ours): at for ours, at in made.places().items()})
    try:
        url = thread.run(made.start(0))
        thread.run(made.scan())
        with Scenario("scenarios/panel_line", bag=tmp_path / "bag") as plant:
            plant.attach_plc(url, tags)
            plant.run_for(1.0)
            commanded = plant.signals["belts/lane/speed"]
            plant.panel.press("estop")
            plant.panel.press("start")
            plant.run_for(1.0)
            stopped, scans = plant.signals["belts/lane/speed"], plant.signals[OWN]
            plant.panel.reset("estop")
            plant.run_for(1.0)
            assert commanded > 0.0 and stopped == 0.0 and plant.signals["belts/lane/speed"] == 0.0
            assert plant.signals[OWN] > scans and plant.signals["panel/start/contact"] == 1.0
    finally:
        thread.run(made.stop())
        thread.close()
    assert replay(tmp_path / "bag").difference is None


class Twin:
    """Program of the PLC, run by a test."""

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        return {SPEED: program(inputs[ON_LANE])[0]}


ACTIONS: tuple[tuple[str, Any], ...] = (
    ("panel/start/press", True),
    ("panel/start/press", False),
    ("panel/estop/press", True),
    ("panel/mode/turn", 0),
    ("panel/speed/set", 0.45),
    ("panel/estop/reset", True),
    ("panel/mode/turn", 1),
    ("panel/speed/set", 0.2),
)
"""Writes of the operator, over and over."""


def operate(address: str, written: Counter[str], ends: threading.Event) -> None:
    """Use the panel over OPC UA until the test ends, at any moment of the line. written: writes by tag."""
    from asyncua import ua
    from asyncua.sync import Client

    client = Client(address, timeout=60, watchdog_intervall=60)
    client.set_user("jo")
    client.set_password("geheim")
    with client:
        kinds = {bool: ua.VariantType.Boolean, int: ua.VariantType.UInt32, float: ua.VariantType.Double}
        while not ends.is_set():
            for name, value in ACTIONS:
                client.get_node(f"ns=2;s={name}").write_value(ua.Variant(value, kinds[type(value)]))
                written[name] += 1


@pytest.mark.parametrize("kind", ["modbus", "opcua"])
def test_an_operator_and_a_plc_act_at_the_same_moment(opcua: Any, tmp_path: Path, kind: str) -> None:
    thread, made = ServerThread(), KINDS[kind]()
    places = {BOTTLES: ON_LANE, SETPOINT: SPEED}
    tags = write_map(tmp_path / "tags.csv", {places.get(ours, ours): at for ours, at in made.places().items()})
    written: Counter[str] = Counter()
    ends = threading.Event()
    try:
        url = thread.run(made.start(0))
        thread.run(made.scan())
        with Scenario(LINE, bag=tmp_path / "bag") as plant:
            server = opcua(plant, users={"jo": ("operator", "geheim")})
            user = threading.Thread(target=operate, args=(server.address, written, ends))
            user.start()
            plant.attach_plc(url, tags)
            plant.run_until(lambda _: sum(written.values()) > 200 or not user.is_alive(), within=500.0)
            ends.set()
            user.join()
            plant.run_for(0.1)
            state, ticks = plant.simulation.state_hash(), plant.simulation.tick
    finally:
        ends.set()
        thread.run(made.stop())
        thread.close()
    report = replay(tmp_path / "bag")
    assert report.exact and report.difference is None
    with open_bag(tmp_path / "bag") as bag:
        acted = [(frame.tick, frame.data) for frame in bag.outcomes() if frame.data.source == "opcua"]
    assert Counter(outcome.names[0] for _, outcome in acted) == written
    assert all(outcome.accepted for _, outcome in acted)
    assert [outcome.names[0] for _, outcome in acted] == [name for name, _ in ACTIONS] * (len(acted) // len(ACTIONS))
    # The same program in this process, and the operator's actions at the ticks at which they acted.
    with Scenario(LINE) as twin:
        twin.attach(Twin())
        while twin.simulation.tick < ticks:
            while acted and acted[0][0] == twin.simulation.tick:
                _, outcome = acted.pop(0)
                twin.simulation.give(Input("opcua", "opcua jo", "operator", SET, outcome.names, outcome.values))
            twin.run_for(twin.scene.tick)
        assert not acted and twin.simulation.state_hash() == state
