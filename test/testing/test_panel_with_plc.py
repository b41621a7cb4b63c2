# SPDX-License-Identifier: Apache-2.0
"""An emergency stop that takes power from a belt while a PLC in lockstep commands its speed."""

from __future__ import annotations

from pathlib import Path

import pytest
from testing.plc_servers import KINDS, OWN, write_map
from testing.soft_plc import BOTTLES, SETPOINT

from conveyor_sim.bag.replay import replay
from conveyor_sim.protocols.hosting.server_thread import ServerThread
from conveyor_sim.testing.scenario import Scenario

pytest.importorskip("pymodbus", reason="pymodbus is not installed: pip install conveyor-sim[scada]")


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
