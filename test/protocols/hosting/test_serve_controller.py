# SPDX-License-Identifier: Apache-2.0
"""`serve --controller`: a controller in the process of the simulation owns the line that clients see; `demo`."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import packages_distributions, requires
from pathlib import Path
from urllib.request import urlopen

import pytest
from facts import missing
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from protocols.modbus.modbus_line import speed_of
from protocols.served import COMMAND, Served
from protocols.waiting import PATIENCE, until

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.line.commands.inputs import MODE, SET, Input
from conveyor_sim.line.run_state import STOPPED
from conveyor_sim.protocols.tags.scene_messages import SceneTask
from conveyor_sim.protocols.tags.scene_provider import SceneTagProvider
from conveyor_sim.run.controller_source import ControllerSource
from conveyor_sim.run.runner import run_scene
from conveyor_sim.scene import load_scene

pytest.importorskip("pymodbus", reason="pymodbus is not installed: pip install conveyor-sim[scada]")

from pymodbus.client import ModbusTcpClient

RUN = Path(__file__).parents[3] / "requirements" / "run.txt"
SCENE = "scenarios/zoned_line"
FIRST, SECOND = "belts/zone1/cmd_speed", "belts/zone2/cmd_speed"
STATES = {"bottles", "belts", "signals", "counters"}

PROGRAM = '''
class Speeds:
    """Both speeds depend on the bottles on the belt, so a scan that is missing would show."""

    def __init__(self, base: float = 0.3) -> None:
        self.base = base

    def scan(self, inputs):
        speed = self.base + 0.01 * min(5, inputs["belts/zone1/bottles"])
        return {"belts/zone1/cmd_speed": speed, "belts/zone2/cmd_speed": speed}
'''


@pytest.fixture
def program(tmp_path: Path) -> str:
    """Return the reference of a controller."""
    (tmp_path / "speeds.py").write_text(PROGRAM)
    return f"{tmp_path / 'speeds.py'}:Speeds"


@pytest.fixture
def without_extras(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder for PYTHONPATH that hides all packages but those which this package requires without extras."""
    required: set[str] = set()
    more = [line for line in RUN.read_text().splitlines() if not line.startswith("#")]
    while more:
        requirement = Requirement(more.pop())
        name = canonicalize_name(requirement.name)
        if name not in required and (requirement.marker is None or requirement.marker.evaluate({"extra": ""})):
            required.add(name)
            more.extend(requires(name) or ())
    hidden = [
        module
        for module, names in packages_distributions().items()
        if (required | {"conveyor-sim"}).isdisjoint(map(canonicalize_name, names))
    ]
    assert "asyncua" in hidden and "aiohttp" not in hidden
    folder = tmp_path_factory.mktemp("without_extras")
    (folder / "sitecustomize.py").write_text(f"import sys\nsys.modules.update(dict.fromkeys({hidden!r}))\n")
    return folder


def states(bag: Path) -> dict[tuple[str, int], bytes]:
    """Return the messages of a recording by topic and simulated time."""
    with open_bag(bag) as found:
        return {(topic, time): data for topic, time, data in found.raw(STATES)}


def test_the_states_are_those_of_a_run_with_the_controller(
    command: Callable[..., Served], tmp_path: Path, program: str
) -> None:
    with_program = ("--controller", program, "--parameters", "{base: 0.2}")
    served = command(
        SCENE, "--modbus", "0", *with_program, "--out", "bag", "--duration", "3", "--real-time-factor", "0"
    )
    until(lambda: "end of the run" in served.told, "the end of the run")
    assert "recorded to bag" in served.end()
    scene = load_scene(f"config/{SCENE}.yaml", {"duration": 3.0})
    run_scene(scene, tmp_path / "run", controller=ControllerSource(program, {"base": 0.2}).load())
    assert states(tmp_path / "bag") == states(tmp_path / "run")
    report = replay(tmp_path / "bag")
    assert report.exact and report.difference is None
    with open_bag(tmp_path / "bag") as bag:
        assert [frame.data.writer for frame in bag.outcomes() if frame.data.operation == "own"] == ["Speeds"]


def test_the_second_step_of_the_tutorial_serves_its_controller(command: Callable[..., Served], tmp_path: Path) -> None:
    page = (Path(__file__).parents[3] / "docs" / "build_a_line.md").read_text()
    for name, text in re.findall(r"```(?:python|yaml)\n# (\S+)\n(.*?)```", page, re.DOTALL):
        (tmp_path / name).write_text(text)
    (line,) = re.findall(r"^    conveyor-sim serve (.*) --web$", page, re.MULTILINE)
    served = command(*line.split(), "--web", "0", "--duration", "60", "--real-time-factor", "0", "--out", "bag")
    until(lambda: "end of the run" in served.told, "the end of the run")
    served.end()
    with open_bag(tmp_path / "bag") as bag:
        speeds = {
            frame.data.values[0] for frame in bag.outcomes() if frame.data.source == "controller" and frame.data.values
        }
    assert speeds == {0.0, 0.4}


def test_another_controller_is_refused(command: Callable[..., Served], program: str) -> None:
    served = command(SCENE, "--modbus", "0", "--modbus-role", "controller", "--no-record", "--controller", program)
    with ModbusTcpClient("127.0.0.1", port=served.port, timeout=60) as client:
        until(lambda: speed_of(client) < 0.4, "the speed that the program commands")  # 0.5 without it
        assert client.write_registers(0, client.convert_to_registers(0.1, client.DATATYPE.FLOAT32)).isError()
    assert f"{program} commands the line" in served.told
    served.end()


def line_of(program: str, said: list[str]) -> SceneTagProvider:
    scene = load_scene(f"config/{SCENE}.yaml", {"duration": 1000.0})
    source = SceneTagProvider(SceneTask(scene, None, 0, 1.0, 1, controller=ControllerSource(program)), said.append)
    source.wait_for_line()
    return source


def test_an_operator_takes_one_device_and_the_controller_keeps_the_others(program: str) -> None:
    said: list[str] = []

    def jo(operation: str, name: str, value: float) -> Input:
        return Input("opcua", "Jo", "operator", operation, (name,), (value,))

    with line_of(program, said) as source:
        until(lambda: source.snapshot.values[SECOND] >= 0.3, "the program's speed")
        assert source.give(jo(MODE, "belts/zone1", 3.0)) == ""
        assert source.give(jo(SET, FIRST, 0.11)) == ""
        until(lambda: source.snapshot.values[FIRST] == 0.11, "the operator's speed")
        tick = source.snapshot.tick
        until(lambda: source.snapshot.tick > tick + 20, "ticks with refused commands of the program")
        assert source.snapshot.values[FIRST] == 0.11
        assert source.snapshot.values[SECOND] >= 0.3
        assert source.give(jo(MODE, "belts/zone1", 1.0)) == ""
        until(lambda: source.snapshot.values[FIRST] >= 0.3, "the program's speed again")
    assert not [sentence for sentence in said if "stopped:" in sentence]


def test_a_reset_loads_the_program_as_it_is_then(program: str) -> None:
    said: list[str] = []
    with line_of(program, said) as source:
        until(lambda: source.snapshot.values[FIRST] >= 0.3, "the program's speed")
        file = Path(program.rpartition(":")[0])
        file.write_text(PROGRAM.replace("base: float = 0.3", "base: float = 0.05"))
        run = source.snapshot.run_id
        assert source.control("reset", 0.0, "a test") == ""
        until(lambda: source.snapshot.run_id != run and source.snapshot.tick > 3, "the next run")
        assert 0.05 <= source.snapshot.values[FIRST] <= 0.1
        file.write_text(PROGRAM + "\nraise RuntimeError('half typed')\n")
        assert source.control("reset", 0.0, "a test") == ""
        until(lambda: source.snapshot.run.state == STOPPED, "the refusal")
        assert not missing(source.snapshot.run.reason, "speeds.py:12", "RuntimeError", "half typed")
        file.write_text(PROGRAM)
        run = source.snapshot.run_id
        assert source.control("reset", 0.0, "a test") == ""
        until(lambda: source.snapshot.run_id != run and source.snapshot.values[FIRST] >= 0.3, "the mended program")


@pytest.mark.parametrize(("statement", "name"), [("1 / 0", "ZeroDivisionError"), ("exit(3)", "SystemExit")])
def test_a_program_that_fails_stops_the_run_with_its_place(program: str, statement: str, name: str) -> None:
    Path(program.rpartition(":")[0]).write_text(
        PROGRAM.replace("speed = self.base", f"speed = {statement} + self.base")
    )
    said: list[str] = []
    with line_of(program, said) as source:
        until(lambda: source.snapshot.run.state == STOPPED, "the end")
        assert not missing(source.snapshot.run.reason, "speeds.py:9", name)


@pytest.mark.parametrize(
    ("options", "facts"),
    [
        (["--controller", "no_such.py:Speeds"], ["no file no_such.py"]),
        (["--controller", "speeds.py:Slow"], ["speeds.py", "Slow"]),
        (["--controller", "speeds.py:Speeds", "--parameters", "{base: [}"], ["--parameters"]),
        (["--controller", "speeds.py:Speeds", "--parameters", "{bass: 1}"], ["bass", "base"]),
        (["--parameters", "{base: 1}"], ["--parameters", "--controller"]),
        (["--controller", "speeds.py:Speeds", "--lockstep", "--modbus-role", "controller"], ["--controller", "PLC"]),
        (["--controller", "speeds.py:Speeds", "--record-variables", "state"], ["record", "state"]),
    ],
)
def test_a_wrong_controller_is_one_sentence_and_leaves_nothing(
    command: Callable[..., Served], tmp_path: Path, program: str, options: list[str], facts: list[str]
) -> None:
    served = command(SCENE, "--modbus", "0", "--out", "bag", *options)
    assert served.process.wait(timeout=PATIENCE) == 1
    (sentence,) = served.told.splitlines()[-1:]
    assert sentence.startswith("Error: ")
    assert not missing(sentence, *facts)
    assert not (tmp_path / "bag").exists()


def test_the_demo_shows_a_line_that_its_controller_runs(tmp_path: Path, without_extras: Path) -> None:
    with (tmp_path / "log").open("w") as log:
        demo = subprocess.Popen(
            [sys.executable, *COMMAND[:-1], "demo", "--no-browser"],
            cwd=tmp_path,
            stdout=log,
            stderr=log,
            env={**os.environ, "PYTHONPATH": str(without_extras)},
        )
    try:
        told = (tmp_path / "log").read_text
        until(lambda: "http://127.0.0.1:" in told() or demo.poll() is not None, "the page")
        page = re.search(r"http://127\.0\.0\.1:\d+/", told())
        assert page, told()
        assert b'<meta name="line" content="live">' in urlopen(page.group(), timeout=PATIENCE).read()
        demo.send_signal(signal.SIGINT)
        assert demo.wait(PATIENCE) == 0, told()
    finally:
        demo.kill()
        demo.wait()
    assert [entry.name for entry in tmp_path.iterdir()] == ["log"]
