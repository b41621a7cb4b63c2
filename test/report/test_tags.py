"""The command `tags`: of no shipped scene anything is left empty."""

import csv
import io
from pathlib import Path

import pytest
from click.testing import CliRunner
from scenes import SHIPPED, shipped_name

from conveyor_sim.cli import main
from conveyor_sim.report.tags import NONE, TagRow, tag_csv, tag_rows
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation


@pytest.mark.parametrize("path", SHIPPED, ids=shipped_name)
def test_nothing_is_empty(path: Path) -> None:
    rows = tag_rows(load_scene(path))
    assert rows and all(all(row) for row in rows)
    for row in rows:
        assert (row.nominal != NONE) == row.tag.endswith("/rate")
        assert (row.texts == NONE) == (row.kind in ("count", "number"))


def test_rows_are_the_process_image_in_its_order() -> None:
    scene = load_scene("config/scenarios/reject_line.yaml", {"where": "packaging/line_1"})
    image = Simulation(scene).process_image
    rows = tag_rows(scene)
    assert [row.tag for row in rows] == [tag.name for tag in image.tags]
    assert {*image.signal_names, *image.command_names, *image.fault_names} <= {row.tag for row in rows}
    assert all(row.path == f"packaging/line_1/{row.tag}" for row in rows)
    assert [row.tag for row in rows if row.role == "run"] == ["run/state"]
    assert list(csv.reader(io.StringIO(tag_csv(scene)))) == [list(TagRow._fields), *map(list, rows)]


def test_the_command() -> None:
    csv_text = CliRunner().invoke(main, ["tags", "scenarios/reject_line", "--csv"])
    assert csv_text.exit_code == 0
    assert csv_text.output == tag_csv(load_scene("config/scenarios/reject_line.yaml"))
    table = CliRunner().invoke(main, ["tags", "scenarios/zoned_line"])
    assert table.exit_code == 0 and "machines/filler/rate" in table.output and "Nominal: " in table.output
    wrong = CliRunner().invoke(main, ["tags", "nowhere"])
    assert wrong.exit_code == 1 and "no such scene file" in wrong.output
