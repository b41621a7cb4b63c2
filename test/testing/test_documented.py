# SPDX-License-Identifier: Apache-2.0
"""docs/testing_control_logic.md does what it says: its files, run in its order."""

import os
import re
import sys
from pathlib import Path

import pytest
from testing.conftest import TABLE

from conveyor_sim.testing import Scenario

DOCS = Path(__file__).parent.parent.parent / "docs"
PAGE = (DOCS / "testing_control_logic.md").read_text()
BLOCKS = re.findall(r"```(?:python|yaml)\n# (\S+)\n(.*?)```", PAGE, re.DOTALL)
NAMES = [
    "test_first.py",
    "test_panel.py",
    "table.yaml",
    "level.py",
    "test_level.py",
    "level.py",
    "test_warm.py",
    "test_node.py",
    "by_hand.py",
]
PLUGIN = ("-p", "conveyor_sim.testing.plugin", "-p", "no:cacheprovider")


def write(folder: Path, *blocks: int) -> None:
    for block in blocks:
        name, text = BLOCKS[block]
        (folder / name).write_text(f"# {name}\n{text}")


def timeless(text: str) -> str:
    """Without the hundredths of seconds, in which processors may differ."""
    return re.sub(r"\d+\.\d\d s", "_ s", text)


def test_the_blocks_are_these() -> None:
    assert [name for name, _ in BLOCKS] == NAMES
    assert BLOCKS[2][1] == TABLE.read_text().removeprefix("# table.yaml\n")


def test_the_first_scenario_passes(pytester: pytest.Pytester) -> None:
    write(pytester.path, 0)
    pytester.runpytest_inprocess(*PLUGIN).assert_outcomes(passed=1)


def test_operators_and_engineers_do_as_shown(pytester: pytest.Pytester) -> None:
    write(pytester.path, 1)
    pytester.runpytest_inprocess(*PLUGIN).assert_outcomes(passed=2)


def test_the_bug_is_found_as_shown(pytester: pytest.Pytester) -> None:
    write(pytester.path, 2, 3, 4)
    result = pytester.runpytest_inprocess(*PLUGIN)
    result.assert_outcomes(passed=1, failed=1)
    shown = re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL)[0]
    assert timeless(shown) in timeless(result.stdout.str().replace(f"{pytester.path}/", ""))
    (picture,) = pytester.path.rglob("line.png")
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_the_mended_controller_passes(pytester: pytest.Pytester) -> None:
    write(pytester.path, 2, 5, 4)
    pytester.runpytest_inprocess(*PLUGIN).assert_outcomes(passed=2)
    assert not (pytester.path / "line-failures").exists()


def test_it_starts_from_a_warm_line(pytester: pytest.Pytester) -> None:
    write(pytester.path, 2, 5, 6)
    pytester.runpytest_inprocess(*PLUGIN).assert_outcomes(passed=2)


def test_a_node_is_the_controller(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    """The node's command lies beside this interpreter, as in an activated environment."""
    pytest.importorskip("rclpy", reason="ROS 2 is not sourced")
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent), prepend=os.pathsep)
    write(pytester.path, 2, 5, 7)
    pytester.runpytest_inprocess(*PLUGIN).assert_outcomes(passed=1)


def test_it_goes_without_pytest(capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(BLOCKS[8][1], "by_hand.py", "exec"), {})
    assert capsys.readouterr().out == "0.1\n"


def test_what_it_says_of_a_scenario_there_is() -> None:
    table = PAGE.split("## What a scenario can do")[1].split("Faults that")[0]
    cells = re.findall(r"^\| (`.*?) \|", table, re.MULTILINE)
    named = {name for cell in cells for name in re.findall(r"`(\w+)", cell)}
    assert {"attach", "always", "never", "history"} <= named
    with Scenario(TABLE) as scenario:
        assert [name for name in named if not hasattr(scenario, name)] == []


@pytest.mark.parametrize("path", sorted(set(re.findall(r"\]\(([^)#:]+)\)", PAGE))))
def test_links_lead_somewhere(path: str) -> None:
    assert (DOCS / path).exists()
