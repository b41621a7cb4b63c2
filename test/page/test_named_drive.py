# SPDX-License-Identifier: Apache-2.0
"""Faceplates of a named drive and of its belts, which lead to each other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from page.conftest import opened_page
from page.line import record
from scenes import DRIVEN_LINE

from conveyor_sim.page.one_file import write_page


def rows(page: Any) -> list[str]:
    """Return the names of the tags on the faceplate."""
    return [text.split()[0] for text in page.locator("#panel_device table th[scope=row]").all_inner_texts()]


def test_belts_lead_to_their_drive_and_the_drive_to_its_belts(browser: Any, tmp_path: Path) -> None:
    bag = record(tmp_path / "bag", seconds=0.5, closes=False, line=DRIVEN_LINE)
    with opened_page(browser, write_page(bag, tmp_path / "line.html")) as page:
        choice = page.locator("#panel_device select")
        assert page.locator("#panel_device .moves button").count() == 2  # the first device is the drive
        assert choice.input_value() == "drives/m1"
        assert {"speed", "running", "at_speed", "fault", "cmd_speed", "run", "reverse", "reset"} <= set(rows(page))
        page.click("#panel_device .moves button:has-text('belts/feeder')")
        assert choice.input_value() == "belts/feeder"
        assert rows(page) == ["speed", "bottles"]
        page.click("#panel_device .moves button:has-text('drives/m1')")
        assert choice.input_value() == "drives/m1"
        page.select_option("#panel_device select", "belts/exit")
        assert page.locator("#panel_device .moves").count() == 0
