# SPDX-License-Identifier: Apache-2.0
"""Controllers by name."""

from __future__ import annotations

from pathlib import Path

import pytest
from control.scans import Scans

from conveyor_sim.control import Constant, ControlError, load

FILE = """
from __future__ import annotations

from dataclasses import dataclass

from conveyor_sim.control import Inputs


@dataclass
class Steady:
    belt: str
    speed: float = 0.5

    def scan(self, inputs: Inputs) -> dict[str, float]:
        return {f"belts/{self.belt}/cmd_speed": self.speed}


def no_controller():
    return 3


LIMIT = 7
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "steady.py"
    path.write_text(FILE)
    return path


def test_a_controller_of_a_module() -> None:
    assert load("conveyor_sim.control.scan:Constant", {"commands": {"a": 1.0}}) == Constant({"a": 1.0})


def test_a_controller_of_a_file(file: Path) -> None:
    assert Scans(load(f"{file}:Steady", {"belt": "in"})).scan({}) == {"belts/in/cmd_speed": 0.5}


@pytest.mark.parametrize(
    ("factory", "parameters", "says"),
    [
        ("Unsteady", {}, "has no 'Unsteady'"),
        ("LIMIT", {}, "LIMIT is 7, expected a class or a function"),
        ("no_controller", {}, r"made a int, expected an object with scan\(inputs\)"),
        ("Steady", {}, "missing a required argument: 'belt'; its parameters are belt: 'str', speed: 'float' = 0.5"),
        ("Steady", {"belt": "in", "sped": 1.0}, "unexpected keyword argument 'sped'"),
    ],
)
def test_what_a_file_does_not_have(file: Path, factory: str, parameters: dict[str, object], says: str) -> None:
    with pytest.raises(ControlError, match=says):
        load(f"{file}:{factory}", parameters)


@pytest.mark.parametrize(
    ("reference", "says"),
    [
        ("level", "'level': expected module:factory or file.py:factory"),
        ("no_such_module:Level", "No module named 'no_such_module'"),
        ("nowhere/level.py:Level", "no file nowhere/level.py"),
    ],
)
def test_what_is_not_there(reference: str, says: str) -> None:
    with pytest.raises(ControlError, match=says):
        load(reference)
