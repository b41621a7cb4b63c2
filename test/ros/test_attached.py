# SPDX-License-Identifier: Apache-2.0
"""A ROS node attached to a scenario as its controller, over real DDS."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conveyor_msgs import srv
from facts import missing, stating
from ros.conftest import SMALL_LINE
from ros.line_client import LineClient, until
from ros.small_line_controller import make
from ros.test_lifeline import runs

from conveyor_sim.control import ControlError
from conveyor_sim.errors import CommandError
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.testing import Scenario

HIGH = 13  # bottles on the table at which the feeder is held
FEEDER = "belts/feeder/cmd_speed"
FULL = "alarms/table full"
STUCK = "photo_eyes/entry/stuck_on"
NODE = [sys.executable, "-m", "conveyor_sim.ros.controller_node", "--ros-args", "-r", "__ns:=/cell"]
NODE += ["-p", f"controller:={Path(__file__).with_name('small_line_controller.py')}:make"]
NODE += ["-p", f"parameters:='{{high: {HIGH}}}'"]


@pytest.fixture
def scenario() -> Iterator[Scenario]:
    """The small line."""
    with Scenario(SMALL_LINE) as scenario:
        yield scenario


def test_a_node_gives_the_bits_of_its_scan_function(scenario: Scenario) -> None:
    environment = dict(os.environ)
    with Scenario(SMALL_LINE, {"duration": 1.0}) as other:  # the test decides the duration, not the scene
        scenario.attach(make(HIGH))
        other.attach_node(NODE, namespace="/cell")
        assert os.environ == environment
        for line in (scenario, other):
            line.run_for(3.0)
        for name in (FEEDER, "belts/table/cmd_speed", "belts/table/bottles"):
            assert np.array_equal(other.history[name], scenario.history[name])
        assert other.simulation.state_hash() == scenario.simulation.state_hash()
        assert np.ptp(other.history[FEEDER]) > 0.0  # it did act
        assert np.array_equal(other.history[FULL], scenario.history[FULL])
        assert np.ptp(other.history[FULL]) > 0.0  # it did come
        assert other.simulation.alarms == other.alarms == scenario.alarms
        for line in (scenario, other):  # as it was declared, with the first request
            assert line.simulation.line.alarms["table full"].text == f"{HIGH} bottles on the table"


def test_it_is_served_as_by_the_simulation_s_own_node(scenario: Scenario, domain: int, client: LineClient) -> None:
    def scans() -> dict[str, Any]:
        return {
            "probe": client.lockstep(0),
            "five": client.lockstep(5, names=[FEEDER], values=[0.25]),
            "again": client.lockstep(5, names=[FEEDER], values=[0.25]),
            "stranger": client.lockstep(6, run_id="other"),
            "seven": client.lockstep(7, release=True),
        }

    with ThreadPoolExecutor(1) as pool:
        node = pool.submit(scans)
        scenario.attach_node((), domain=domain)
        scenario.inject(STUCK)
        scenario.run_for(0.3)
        answers = node.result()

    engine = Simulation(load_scene(SMALL_LINE))
    engine.command([FEEDER], [0.25])
    engine.inject(STUCK, 1.0)
    for name, tick in (("probe", 0), ("five", 5), ("stranger", 5), ("seven", 7)):
        engine.advance(tick - engine.tick)
        answer = answers[name]
        assert (answer.tick, answer.state_hash) == (tick, engine.state_hash() if tick else answer.state_hash)
        assert answer.signals.tick == tick
    assert np.array_equal(answers["seven"].signals.values, engine.signals())
    assert answers["again"] == answers["five"]
    assert [(each.source, list(each.names), each.accepted) for each in answers["five"].outcomes] == [
        ("fault", [STUCK], True),
        ("lockstep", [FEEDER], True),
    ]
    assert not (answers["probe"].accepted or answers["stranger"].accepted)
    assert "stale: target_tick 0 given" in answers["probe"].reason
    assert "owned by run 'test'" in answers["stranger"].reason
    engine.advance(30 - engine.tick)  # released, it goes on alone
    assert scenario.simulation.state_hash() == engine.state_hash()


def test_a_refused_command_fails(scenario: Scenario, domain: int, client: LineClient) -> None:
    def ask() -> None:
        request = srv.Lockstep.Request(run_id="test", target_tick=1, names=[FEEDER], values=[])
        client.client(srv.Lockstep, "/cell/conveyor_sim/lockstep").call_async(request)

    with ThreadPoolExecutor(1) as pool:
        pool.submit(ask)
        with pytest.raises(CommandError, match=stating("at 0.00 s", "refused", "1 names", "0 values")):
            scenario.attach_node((), namespace="/cell", domain=domain)


def test_a_node_that_never_asks(scenario: Scenario, tmp_path: Path) -> None:
    file = tmp_path / "pid"
    with pytest.raises(ControlError) as failure:
        scenario.attach_node(["sh", "-c", f"echo $$ > {file}; exec sleep 600"], namespace="/cell", patience=2.0)
    text = str(failure.value)
    facts = ["at 0.00 s", "no request", "after 0", "within 2 s", "/cell/conveyor_sim/lockstep", "ROS domain"]
    assert missing(text, facts) == []
    scenario.close()
    assert not Path("/proc", file.read_text().strip()).exists()


def test_a_test_that_is_killed_takes_its_node_with_it(tmp_path: Path) -> None:
    file = tmp_path / "pid"
    code = "import sys; from conveyor_sim.testing import Scenario; "
    code += "Scenario(sys.argv[1]).attach_node(sys.argv[2:], patience=600)"
    node = ["sh", "-c", f"echo $$ > {file}; exec sleep 600"]
    test = subprocess.Popen([sys.executable, "-c", code, str(SMALL_LINE), *node])
    until(lambda: file.exists() and file.read_text().strip(), "the node")
    test.kill()
    test.wait()
    until(lambda: not runs(int(file.read_text())), "the end of the node")


def test_a_node_that_ends(scenario: Scenario) -> None:
    with pytest.raises(ControlError) as failure:
        scenario.attach_node([sys.executable, "-c", "raise SystemExit('no such recipe')"])
    ended = "controller ended with exit code 1; the end of its log:\n  no such recipe"
    assert str(failure.value) == f"at 0.00 s no controller: {ended}"
