# SPDX-License-Identifier: Apache-2.0
"""`serve --lockstep`: a PLC in a separate process steps the line, with the same bits as the same program in a test."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from protocols.served import Served
from protocols.waiting import PATIENCE, until
from testing.soft_plc import BOTTLES, SETPOINT, speed

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.control.scan import Inputs
from conveyor_sim.protocols.server.users import line_of, new_user
from conveyor_sim.support.resources import scene_path
from conveyor_sim.testing.plc import ADDRESS, PASSWORD
from conveyor_sim.testing.scenario import Scenario

SCENE = "scenarios/zoned_line"
PLC = Path(__file__).parents[2] / "testing" / "soft_plc.py"
SCANS = 600
STATES = {"bottles", "belts", "signals", "counters"}


class Twin:
    """Program of the PLC, run by a test."""

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        return {SETPOINT: speed(inputs[BOTTLES])}


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[str, int], bytes]:
    """Return the recording of a line whose test runs the program."""
    bag = tmp_path_factory.mktemp("inside") / "bag"
    with Scenario(SCENE, bag=bag) as line:
        line.attach(Twin())
        line.run_for(SCANS * line.simulation.scene.tick)
        assert np.ptp(line.history[SETPOINT]) > 0.0  # it does act
    return states(bag)


def states(bag: Path) -> dict[tuple[str, int], bytes]:
    """Return the messages of a recording by topic and simulated time."""
    with open_bag(bag) as found:
        return {(topic, time): data for topic, time, data in found.raw(STATES)}


def served(command: Callable[..., Served], folder: Path, face: str, bag: str) -> None:
    """Let a PLC step a line to its end."""
    (folder / "users").write_text(line_of("plc", new_user("controller", "open sesame")))
    of_face = {
        "modbus": ("--modbus", "0", "--modbus-role", "controller"),
        "opcua": ("--opcua", "0", "--opcua-users", "users", "--opcua-certificates", "own"),
    }[face]
    seconds = f"{SCANS / 100:g}"
    line = command(SCENE, "--lockstep", *of_face, "--duration", seconds, "--out", bag)
    environment = {ADDRESS: line.address, PASSWORD: "open sesame", "SOFT_PLC_FOLDER": str(folder)}
    plc = [sys.executable, str(PLC), str(SCANS)]
    subprocess.run(plc, env={**os.environ, **environment}, check=True, timeout=5 * PATIENCE)
    assert f"served up to {seconds} s; {face} " in line.end()
    assert "in lockstep: simulated time advances only when a client writes run/target_tick" in line.told


@pytest.mark.parametrize("face", ["modbus", "opcua"])
def test_a_plc_gives_the_bits_of_its_program(
    command: Callable[..., Served], tmp_path: Path, expected: dict[tuple[str, int], bytes], face: str
) -> None:
    library = {"modbus": "pymodbus", "opcua": "asyncua"}[face]
    pytest.importorskip(library, reason=f"{library} is not installed: pip install conveyor-sim[scada]")
    served(command, tmp_path, face, "bag")
    found = states(tmp_path / "bag")
    assert {topic for topic, _ in found} == STATES
    assert found == expected
    report = replay(tmp_path / "bag")
    assert report.exact and report.difference is None and report.compared["outcomes"] > 0


PANEL = """
panel:
  start: {kind: button}
  stop: {kind: emergency_stop, cuts: [drives, machines], deceleration: 1}
  mode: {kind: selector, positions: [hand, auto]}
"""
ACTIONS = (
    ("panel/start/press", True), ("panel/stop/press", True), ("panel/mode/turn", 1),
    ("panel/start/press", False), ("panel/stop/reset", True), ("panel/mode/turn", 0),
)  # fmt: skip


def test_an_operator_uses_the_panel_while_a_plc_steps_the_line(command: Callable[..., Served], tmp_path: Path) -> None:
    """Both are clients of one server. Each action acts once, in the order of the writes; the last is a release."""
    ua = pytest.importorskip("asyncua").ua
    from asyncua.sync import Client

    scene = tmp_path / "line.yaml"
    scene.write_text(scene_path(Path(SCENE)).read_text() + PANEL)
    users = {"plc": "controller", "jo": "operator"}
    (tmp_path / "users").write_text("\n".join(line_of(name, new_user(role, "sesame")) for name, role in users.items()))
    served = ("--opcua", "0", "--opcua-users", "users", "--opcua-certificates", "own")
    line = command("line.yaml", "--lockstep", *served, "--duration", "1000", "--out", "bag")
    environment = {ADDRESS: line.address, PASSWORD: "sesame", "SOFT_PLC_FOLDER": str(tmp_path)}
    plc = subprocess.Popen([sys.executable, str(PLC)], env={**os.environ, **environment})
    operator = Client(line.address, timeout=PATIENCE, watchdog_intervall=PATIENCE)
    operator.set_user("jo")
    operator.set_password("sesame")
    try:
        with operator:
            tick = operator.get_node("ns=2;s=run/tick")
            until(lambda: tick.read_value() > 20, "the first scans")
            for name, value in ACTIONS * 20:
                kind = ua.VariantType.Boolean if isinstance(value, bool) else ua.VariantType.UInt32
                operator.get_node(f"ns=2;s={name}").write_value(ua.Variant(value, kind))
            operator.get_node(f"ns=2;s={ACTIONS[0][0]}").write_value(True)
            begun = tick.read_value()
            until(lambda: tick.read_value() > begun + 20, "more scans")
        contact = "panel/start/contact"
        with Client(line.address, timeout=PATIENCE, watchdog_intervall=PATIENCE) as reader:
            until(lambda: not reader.get_node(f"ns=2;s={contact}").read_value(), "the release of the button")
    finally:
        plc.kill()
        plc.wait()
    line.end()
    report = replay(tmp_path / "bag")
    assert report.exact and report.difference is None
    with open_bag(tmp_path / "bag") as bag:
        outcomes = [frame.data for frame in bag.outcomes()]
    assert all(outcome.accepted for outcome in outcomes)
    written = [(one.names[0], one.values[0]) for one in outcomes if one.writer == "opcua jo"]
    assert written == [*ACTIONS * 20, ("panel/start/press", True), ("panel/start/press", False)]
    assert {one.writer for one in outcomes if SETPOINT in one.names} == {"opcua plc"}


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--modbus", "0"], "--lockstep: no client may advance the line, expected --modbus-role controller, or"),
        (
            ["--modbus", "0", "--modbus-role", "controller", "--real-time-factor", "1"],
            "--real-time-factor: given with --lockstep, expected none: the PLC advances the time",
        ),
    ],
)
def test_what_makes_no_lockstep_is_one_sentence(
    command: Callable[..., Served], arguments: list[str], sentence: str
) -> None:
    line = command(SCENE, "--lockstep", *arguments)
    line.process.wait(timeout=PATIENCE)
    assert line.process.returncode == 1 and sentence in line.told
