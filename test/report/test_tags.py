# SPDX-License-Identifier: Apache-2.0
"""The command `tags`: of no shipped scene anything is left empty."""

import csv
import fcntl
import io
import json
import os
import pty
import struct
import subprocess
import sys
import termios
from contextlib import suppress
from pathlib import Path

import pytest
from click.testing import CliRunner
from facts import missing
from scenes import SHIPPED, shipped_name

from conveyor_sim.cli import main
from conveyor_sim.report.tags import NONE, TagRow, chosen_tags, line_tags, tag_csv, tag_listing, tag_rows
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.resources import scene_path

ROOT = Path(__file__).resolve().parents[2]


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
    assert list(csv.reader(io.StringIO(tag_csv(scene, line_tags(scene))))) == [list(TagRow._fields), *map(list, rows)]


def test_they_are_chosen_by_name_and_kind() -> None:
    scene = load_scene("config/scenarios/reject_line.yaml")
    everything = line_tags(scene)
    assert chosen_tags(scene) == list(everything)
    commands = chosen_tags(scene, ["machines/*"], ["command", "setpoint"])
    assert commands == [
        tag for tag in everything if tag.role in ("command", "setpoint") and tag.name.startswith("machines/")
    ]
    assert commands and chosen_tags(scene, kinds=["bool"]) == [tag for tag in everything if tag.kind == "bool"]
    result = CliRunner().invoke(main, ["tags", "scenarios/reject_line", "--kind", "comand"])
    assert (result.exit_code, missing(result.output, ["--kind", "comand", "command", "enumeration"])) == (1, [])
    assert tag_listing([], None) == ["no such tag"]


def test_json_has_numbers_as_numbers() -> None:
    scene = load_scene("config/scenarios/zoned_line.yaml")
    rows = json.loads(CliRunner().invoke(main, ["tags", "scenarios/zoned_line", "--json"]).stdout)
    assert [row["tag"] for row in rows] == [tag.name for tag in line_tags(scene)]
    for row, tag in zip(rows, line_tags(scene), strict=True):
        assert (row["low"], row["high"], row["nominal"]) == (tag.low, tag.high, tag.nominal)
        assert row["texts"] == {str(value): text for value, text in tag.texts.items()}


@pytest.mark.parametrize("path", SHIPPED, ids=shipped_name)
@pytest.mark.parametrize("width", [80, 120])
def test_names_are_whole_and_lines_fit(path: Path, width: int) -> None:
    tags = line_tags(load_scene(path))
    lines = tag_listing(tags, width)
    assert missing("\n".join(lines), *(tag.name for tag in tags)) == []
    assert all(len(line) <= width for line in lines)
    assert len(tag_listing(tags, None)) == len(tags) + 1


@pytest.mark.parametrize(("rows", "paged"), [(20, True), (1000, False)])
def test_a_list_longer_than_the_terminal_goes_to_the_pager(rows: int, paged: bool, tmp_path: Path) -> None:
    pager = tmp_path / "pager"
    pager.write_text("#!/bin/sh\ncat > paged.txt\n")
    pager.chmod(0o755)
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", rows, 100, 0, 0))
    environment = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES")}
    environment |= {"PAGER": str(pager), "TERM": "xterm"}
    code = "from conveyor_sim.cli import main; main()"
    with subprocess.Popen(
        [sys.executable, "-c", code, "tags", "scenarios/zoned_line"],
        stdin=theirs, stdout=theirs, cwd=tmp_path, env=environment,
    ) as process:  # fmt: skip
        os.close(theirs)
        shown = b""
        with suppress(OSError):  # the terminal is gone with the process
            while part := os.read(ours, 65536):
                shown += part
    os.close(ours)
    assert process.returncode == 0
    tags = [tag.name for tag in line_tags(load_scene(scene_path("scenarios/zoned_line")))]
    text = (tmp_path / "paged.txt").read_text() if paged else shown.decode()
    assert missing(text, *tags) == []
    assert (tmp_path / "paged.txt").exists() is paged


def test_the_command() -> None:
    scene = load_scene("config/scenarios/reject_line.yaml")
    csv_text = CliRunner().invoke(main, ["tags", "scenarios/reject_line", "--csv"])
    assert csv_text.exit_code == 0
    assert csv_text.output == tag_csv(scene, line_tags(scene))
    table = CliRunner().invoke(main, ["tags", "scenarios/zoned_line"])
    assert table.exit_code == 0 and "machines/filler/rate" in table.output and "Nominal: " in table.output
    wrong = CliRunner().invoke(main, ["tags", "nowhere"])
    assert wrong.exit_code == 1 and "no such scene file" in wrong.output


@pytest.mark.parametrize("controller", ["table.st", "table.py:controller"])
def test_alarms_of_a_controller_are_listed_with_the_others(tmp_path: Path, controller: str) -> None:
    (tmp_path / "table.st").write_text((ROOT / "examples" / "st" / "table.st").read_text())
    (tmp_path / "table.py").write_text(
        "from conveyor_sim.control import Alarm\n\n"
        "class controller:\n"
        "    declared_alarms = (Alarm('table full', 'the table is full'),)\n"
        "    def scan(self, inputs):\n"
        "        return {}\n"
    )
    scene = ["tags", str(ROOT / "test" / "testing" / "table.yaml"), "--csv"]
    plain = CliRunner().invoke(main, scene).output.splitlines()
    listed = CliRunner().invoke(main, [*scene, "--controller", str(tmp_path / controller)]).output.splitlines()
    (row,) = [line for line in listed if line not in plain]
    assert [line for line in listed if line != row] == plain
    assert "alarms/table full,bool,alarm" in row
    assert ",alarm," in listed[listed.index(row) - 1], "behind the other alarms"


def test_modbus_addresses_are_those_of_the_line_alone() -> None:
    options = ["--modbus", "--controller", str(ROOT / "examples" / "st" / "table.st")]
    refused = CliRunner().invoke(main, ["tags", "accumulation_table", *options])
    assert refused.exit_code and "--modbus: given with --controller" in str(refused.exception) + refused.output
