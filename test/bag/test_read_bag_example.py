# SPDX-License-Identifier: Apache-2.0
"""The example that reads a bag, run as a user does: with rosbags alone."""

import subprocess
import sys
from pathlib import Path

EXAMPLE = Path(__file__).parents[2] / "examples" / "read_bag.py"


def test_example_prints_poses_and_forces(bag: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(EXAMPLE), str(bag)], capture_output=True, text=True, cwd=tmp_path, check=True
    )
    assert done.stdout.startswith("small_line: 2 belts, 5 rails, dt = 0.0001 s")
    assert "\n  0.50 " in done.stdout
    assert "rail" in done.stdout or "bottle" in done.stdout


def test_example_does_not_import_what_it_says_it_does_not_need() -> None:
    text = EXAMPLE.read_text()
    assert "import conveyor_sim" not in text
    assert "import rclpy" not in text
