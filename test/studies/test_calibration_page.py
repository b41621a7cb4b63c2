# SPDX-License-Identifier: Apache-2.0
"""docs/calibration.md is true: its example gives what it shows, and its tables leave out no kind and no column."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from facts import missing

from conveyor_sim.cli import main
from conveyor_sim.scene import parse_scene
from conveyor_sim.studies.calibration.quantities import COLUMNS, KINDS, TEXT_COLUMNS
from conveyor_sim.studies.calibration.reference import tables

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "calibration.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    (text,) = re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)
    return str(text)


def test_the_example_prints_the_entries_that_are_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("measurements.csv").write_text(block("text"))
    result = CliRunner().invoke(main, ["calibrate", "measurements.csv"])
    assert result.exit_code == 0, result.output
    assert result.stdout == block("yaml")


def test_the_entries_that_are_shown_load() -> None:
    scene = parse_scene(
        "name: pasted\nduration: 1\nbottle_types: {b: {radius: 33 mm, mass: 350 g, material: glass}}\n" + block("yaml")
    )
    assert len(scene.base) == len(scene.contacts) == 1


def test_the_tables_are_those_of_the_program() -> None:
    for table in tables()["calibration"].values():
        assert table in PAGE


def test_every_kind_and_column_is_on_the_page_and_in_the_example() -> None:
    example = CliRunner().invoke(main, ["calibrate", "--example"]).stdout
    for name in (*KINDS, *COLUMNS, *TEXT_COLUMNS):
        assert missing(PAGE, f"| `{name}` |") == [] and missing(example, [name]) == []


def test_published_values_name_their_sources() -> None:
    rows = re.findall(r"^\| .* \|$", PAGE.partition("## Published values")[2], re.MULTILINE)[2:]
    assert len(rows) > 5
    for row in rows:
        source = row.strip("| ").split(" | ")[-1]
        assert source.startswith(("[", "as above")), row
    names = set(re.findall(r"\]\[(\w+)\]", PAGE))
    assert names == set(re.findall(r"^\[(\w+)\]: https?://", PAGE, re.MULTILINE))
