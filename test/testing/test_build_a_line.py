# SPDX-License-Identifier: Apache-2.0
"""docs/build_a_line.md does what it says."""

import re
from pathlib import Path

import pytest
from warm import run

from conveyor_sim.testing import Scenario

PAGE = (Path(__file__).parents[2] / "docs" / "build_a_line.md").read_text()
BLOCKS = dict(re.findall(r"```(?:python|yaml)\n# (\S+)\n(.*?)```", PAGE, re.DOTALL))
PLUGIN = ("-p", "conveyor_sim.testing.plugin", "-p", "no:cacheprovider")


def test_the_tests_pass_with_the_controller_and_the_first_fails_without(pytester: pytest.Pytester) -> None:
    for name, text in BLOCKS.items():
        (pytester.path / name).write_text(text)
    pytester.runpytest_inprocess(*PLUGIN).assert_outcomes(passed=2)
    test = pytester.path / "test_my_line.py"
    test.write_text(test.read_text().replace("    plant.attach(StopFeeder())\n", ""))
    result = pytester.runpytest_inprocess(*PLUGIN, "-k", "press")
    result.assert_outcomes(failed=1)
    assert list(pytester.path.rglob("line.png"))


def test_without_a_controller_the_queue_presses_as_it_says(tmp_path: Path) -> None:
    scene = tmp_path / "my_line.yaml"
    scene.write_text(BLOCKS["my_line.yaml"])
    (newtons,) = re.findall(r"largest contact force is (\d+) N;", PAGE)
    with Scenario(scene) as plant:
        plant.run_for(60.0)
        assert plant.simulation.contacts().normal_force.max() == pytest.approx(float(newtons), rel=0.02)


def test_the_example_is_the_scene_of_the_page() -> None:
    assert (Path(__file__).parents[2] / "examples" / "my_line.yaml").read_text() == BLOCKS["my_line.yaml"]


def test_the_scene_passes_its_check(tmp_path: Path) -> None:
    (tmp_path / "my_line.yaml").write_text(f"# my_line.yaml\n{BLOCKS['my_line.yaml']}")
    done = run(["-c", "from conveyor_sim.cli import main; main()", "check", "my_line.yaml"], cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout in PAGE
    assert (tmp_path / "my_line.png").stat().st_size > 1000
