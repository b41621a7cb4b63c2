# SPDX-License-Identifier: Apache-2.0
"""Commands at a limit, from programs whose type has fewer digits than the limit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from conveyor_sim.control.st import StructuredText
from conveyor_sim.errors import CommandError
from conveyor_sim.run.scan_loop import ScanLoop
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.testing import Scenario

COMMAND = "belts/zone1/cmd_speed"
LIMITS = {"conveyors": {"zone1": {"speed_limits": [-0.1, 0.6], "speed": 0.5}}}
PROGRAM = f"""PROGRAM main
VAR {{tag: {COMMAND}}} speed : #; END_VAR
speed := %;
END_PROGRAM
"""


def program(folder: Path, kind: str, value: str) -> StructuredText:
    path = folder / "program.st"
    path.write_text(PROGRAM.replace("#", kind).replace("%", value))
    return StructuredText(path)


def commanded(folder: Path, kind: str, value: str) -> float:
    """Return the command that the line gets from a variable of a type."""
    with Scenario("scenarios/zoned_line", overrides=LIMITS) as plant:
        plant.attach(program(folder, kind, value))
        plant.run_for(0.02)
        return float(
            plant.simulation.line.read_back.values[plant.simulation.process_image.command_names.index(COMMAND)]
        )


@pytest.mark.parametrize(
    ("kind", "value", "taken"),
    [
        ("REAL", "0.6", 0.6),
        ("REAL", "60.0 / 100.0", 0.6),
        ("REAL", "-0.1", -0.1),
        ("REAL", "0.3", float(np.float32(0.3))),
        ("LREAL", "0.6", 0.6),
        ("TIME", "T#600ms", 0.6),
        ("TIME", "T#300ms", 3e8 * 1e-9),
    ],
)
def test_a_value_at_a_limit_is_the_limit(tmp_path: Path, kind: str, value: str, taken: float) -> None:
    assert commanded(tmp_path, kind, value) == taken


@pytest.mark.parametrize(("kind", "value"), [("REAL", "0.6001"), ("REAL", "0.60000008"), ("LREAL", "0.60000002384")])
def test_a_value_beyond_a_limit_is_refused_as_before(tmp_path: Path, kind: str, value: str) -> None:
    with pytest.raises(CommandError, match=r"expected -0\.1 to 0\.6 m/s"):
        commanded(tmp_path, kind, value)


def test_a_run_without_a_test_takes_the_limit_too(tmp_path: Path) -> None:
    simulation = Simulation(load_scene("config/scenarios/zoned_line.yaml", LIMITS), threads=1)
    scans = ScanLoop(simulation, program(tmp_path, "REAL", "0.6"))
    scans.before_tick(None)
    simulation.advance()
    assert simulation.line.read_back.values[simulation.process_image.command_names.index(COMMAND)] == 0.6
