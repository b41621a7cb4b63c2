# SPDX-License-Identifier: Apache-2.0
"""The tables of docs/line.md and docs/parts/ contain every device."""

from conveyor_sim.line.device_kinds import DEVICES
from conveyor_sim.line.line import image_of
from conveyor_sim.line.reference import EVERYTHING, tables
from conveyor_sim.scene import parse_scene


def test_every_class_of_device_is_in_a_table() -> None:
    tags = image_of(parse_scene(EVERYTHING)).tags
    assert {tag.device_class for tag in tags} == {*DEVICES, "alarms", "run"}
    rows = [
        line
        for page in tables().values()
        for name, table in page.items()
        if name not in ("authority", "weihenstephan")
        for line in table.splitlines()
        if line.startswith("| `")
    ]
    assert sum(row.split(" | ")[0].count("`") // 2 for row in rows) == len(tags)
    assert "| `photo_eyes/<e>/delay` | fault | s | 0 | Delay of all changes. |" in rows
