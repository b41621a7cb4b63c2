# SPDX-License-Identifier: Apache-2.0
"""docs/filler_block.md: its test passes, and its steps are those of the scene."""

import re
from pathlib import Path

import pytest

from conveyor_sim.physics.model import build_model
from conveyor_sim.scene import load_scene
from conveyor_sim.support.resources import scene_path

PAGE = (Path(__file__).parents[2] / "docs" / "filler_block.md").read_text()
PLUGIN = ("-p", "conveyor_sim.testing.plugin", "-p", "no:cacheprovider")


def test_the_capper_finds_the_bottles_of_a_dead_valve(pytester: pytest.Pytester) -> None:
    ((name, text),) = re.findall(r"```python\n# (\S+)\n(.*?)```", PAGE, re.DOTALL)
    (pytester.path / name).write_text(text)
    pytester.runpytest_inprocess(*PLUGIN).assert_outcomes(passed=1)


def test_steps_by_accuracy_are_those_of_the_scene() -> None:
    rows = re.findall(r"\| `(draft|standard|fine)`.*\| (\d+) \|", PAGE)
    found = [
        (accuracy, str(build_model(load_scene(scene_path("filler_block"), {"accuracy": accuracy})).steps_per_tick))
        for accuracy, _ in rows
    ]
    assert [accuracy for accuracy, _ in rows] == ["draft", "standard", "fine"]
    assert rows == found
