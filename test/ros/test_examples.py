# SPDX-License-Identifier: Apache-2.0
"""The examples that talk to a running node, run as a user does."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from ros.line_client import LineClient, until
from std_srvs.srv import Trigger

EXAMPLES = Path(__file__).parents[2] / "examples"


def start(name: str, *arguments: str) -> subprocess.Popen[str]:
    command = [sys.executable, str(EXAMPLES / name), *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


@pytest.mark.parametrize(
    ("speed", "code", "says"),
    [("0.25", 0, "applied at tick "), ("9", 1, "belts/feeder/cmd_speed: 9 given, expected 0 to 1")],
)
def test_send_command_tells_what_became_of_it(line: LineClient, speed: str, code: int, says: str) -> None:
    example = start("send_command.py", "feeder", speed)

    def ended() -> bool:
        line.step(1)
        return example.poll() is not None

    until(ended, "the end of the example")
    assert says in example.communicate()[0]
    assert example.returncode == code


def test_read_poses_and_forces_prints_both(line: LineClient) -> None:
    example = start("read_poses_and_forces.py")
    assert example.stdout is not None
    line.call(Trigger, "resume")
    expected = {"small_line: belts feeder, table; rails wall", " bottles, bottle 0 at (", " contacts, bottle "}
    while expected:
        shown = example.stdout.readline()
        assert shown, f"it ended without {expected}"
        expected = {text for text in expected if text not in shown}
    example.terminate()
    example.communicate()


def test_lockstep_controller_scans_and_releases(line: LineClient) -> None:
    example = start("lockstep_controller.py", "table", "30")
    output, _ = example.communicate(timeout=60)
    assert example.returncode == 0, output
    assert "tick 10: 9 bottles on table at 0.2 m/s" in output
    assert "tick 300: " in output
    line.step(1)  # released
