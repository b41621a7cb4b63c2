# SPDX-License-Identifier: Apache-2.0
"""docs/layout.md: its cell and the scene that uses it run. docs/check.md: `check` prints the lines that it shows."""

from __future__ import annotations

import re
from pathlib import Path

from study_page import load_study
from warm import run

from conveyor_sim.simulation import Simulation

CHECK = Path(__file__).parents[3] / "docs" / "check.md"


def test_the_cell_of_the_page_is_used_twice(tmp_path: Path) -> None:
    simulation = Simulation(load_study("scene_pictures").example(tmp_path), threads=1)
    assert {"block_filler", "spare_filler"} <= set(simulation.scene.machines)
    names = simulation.process_image.signal_names
    simulation.advance(round(simulation.scene.duration / simulation.scene.tick))
    image = dict(zip(names, simulation.signals(), strict=True))
    assert image["machines/block_filler/processed"] > image["machines/spare_filler/processed"] > 0


def test_check_prints_the_lines_of_the_page(tmp_path: Path) -> None:
    (command, shown) = re.findall(r"`conveyor-sim (check \S+)`:\n\n```text\n(.*?)```", CHECK.read_text(), re.DOTALL)[0]
    done = run(["-c", "from conveyor_sim.cli import main; main()", *command.split()], cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert without_estimate(done.stdout) == without_estimate(shown)


def without_estimate(text: str) -> list[str]:
    """Return the lines of an output without the speed and the folder of the scene, which depend on the machine."""
    return [re.sub(r"\S+/(?=\w+\.yaml)", "", line) for line in text.splitlines() if not line.startswith("speed ")]
