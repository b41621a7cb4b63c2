# SPDX-License-Identifier: Apache-2.0
"""Programs on the command line: `conveyor-sim run --controller`, and other places that name a controller."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from facts import missing

from conveyor_sim.cli import main
from conveyor_sim.control.scan import ControlError
from conveyor_sim.control.st import StructuredText
from conveyor_sim.control.st.load import load
from conveyor_sim.testing import Scenario

PROGRAMS = Path(__file__).parent.parent.parent.parent / "examples" / "st"
TABLE = Path(__file__).parent.parent.parent / "testing" / "table.yaml"


def command(*words: object) -> tuple[int, str]:
    done = CliRunner().invoke(main, [str(word) for word in words])
    return done.exit_code, done.output


def test_run_has_a_program_control_the_line_and_the_recording_replays(tmp_path: Path) -> None:
    program = PROGRAMS / "table.st"
    code, output = command(
        "run", TABLE, "--duration", 2, "--controller", program, "--out", tmp_path / "bag", "--no-pictures"
    )
    assert code == 0, output
    (sentence,) = (line for line in output.splitlines() if "table.st: " in line)
    assert missing(sentence, ["commands", "not", "machines/packer"]) == []
    code, output = command("replay", tmp_path / "bag")
    assert code == 0, output
    code, output = command("events", tmp_path / "bag")
    assert code == 0, output


def test_run_says_what_is_wrong_with_a_controller(tmp_path: Path) -> None:
    program = tmp_path / "wrong.st"
    program.write_text("PROGRAM p VAR x : INT; END_VAR\nx := TRUE;\nEND_PROGRAM\n")
    code, output = command("run", TABLE, "--no-record", "--controller", program)
    assert code == 1
    assert missing(output, ["wrong.st:2:6", "BOOL True", "INT", "BOOL_TO_INT"]) == []
    code, output = command("run", "two_bottles", "--no-record", "--controller", PROGRAMS / "table.st")
    assert code == 1
    assert missing(output, ["photo_eyes/high/blocked", "tag of this line"]) == []


def test_a_controller_in_python_runs_too(tmp_path: Path) -> None:
    controller = tmp_path / "mine.py"
    controller.write_text(
        "class Mine:\n    def scan(self, inputs):\n        return {'belts/table/cmd_speed': 0.1 + inputs.time}\n"
    )
    code, output = command("run", TABLE, "--duration", 0.1, "--no-record", "--controller", f"{controller}:Mine")
    assert code == 0, output
    controller.write_text("class Mine:\n    def scan(self, inputs):\n        return None\n")
    code, output = command("run", TABLE, "--duration", 0.1, "--no-record", "--controller", f"{controller}:Mine")
    assert code == 1
    assert missing(output, ["at 0.00 s", "scan", "None", "mapping", "commands"]) == []


def test_parameters_of_a_program_are_tags_and_a_map(tmp_path: Path) -> None:
    program = tmp_path / "p.st"
    program.write_text("PROGRAM p VAR x : INT; END_VAR ; END_PROGRAM")
    load(str(program), {"tags": {"p/x": "zones/z/bottles"}})
    with pytest.raises(ControlError, match="speed: 1 given, expected tags"):
        load(str(program), {"speed": 1})
    for nowhere in ("nowhere.st", "nowhere.so"):
        with pytest.raises(ControlError, match="no such file"):
            load(nowhere)


def test_a_program_as_a_node_gives_the_bits_that_it_gives_attached(tmp_path: Path) -> None:
    pytest.importorskip("rclpy")
    program = PROGRAMS / "table.st"
    node = [sys.executable, "-m", "conveyor_sim.ros.controller_node", "--ros-args", "-p", f"controller:={program}"]
    node = ["sh", "-c", f'exec "$@" 2> "{tmp_path / "log"}"', "sh", *node]
    hashes = []
    for attach in (lambda plant: plant.attach(StructuredText(program)), lambda plant: plant.attach_node(node)):
        with Scenario(TABLE) as plant:
            attach(plant)
            plant.run_for(2.0)
            hashes.append(plant.simulation.state_hash())
    assert hashes[0] == hashes[1]
    (sentence,) = (line for line in (tmp_path / "log").read_text().splitlines() if "table.st: " in line)
    assert missing(sentence, ["commands", "not", "machines/packer"]) == []
