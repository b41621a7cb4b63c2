# SPDX-License-Identifier: Apache-2.0
"""The page of a failed test, in a real browser: its condition, signals and last action."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from facts import missing
from page.conftest import opened_page
from page.line import LINE
from page.pixels import settled

from conveyor_sim.page.watch import Watch
from conveyor_sim.testing.evidence import keep_bag, keep_page
from conveyor_sim.testing.scenario import Scenario

QUEUE, GATE, FAULT, FULL = (
    "zones/before_capper/bottles",
    "gates/hold/open",
    "photo_eyes/exit/stuck_on",
    "alarms/capper_full",
)
LEAST = 18


@pytest.fixture(scope="module")
def html(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the page of a test that closes the gate at 6 s and fails a few seconds later."""
    folder = tmp_path_factory.mktemp("failed")
    line, watch = Scenario(LINE, inputs=folder / "inputs"), Watch(60.0)
    line.run_for(4.0)
    line.inject(FAULT)
    line.run_for(2.0)
    line.command(GATE, 0.0)
    with pytest.raises(AssertionError):
        line.always(lambda s: s[QUEUE] < LEAST or s[FULL] > 2.0, for_=20.0)
    keep_bag(line, folder / "inputs", folder / "bag", watch)
    return keep_page(line, folder / "bag", folder / "line.html", watch)


@pytest.fixture
def page(browser: Any, html: Path) -> Iterator[Any]:
    with opened_page(browser, html) as opened:
        settled(opened)
        yield opened


def test_the_condition_is_shown_in_words_with_its_values(page: Any) -> None:
    panel = page.inner_text("#panel_failure")
    assert missing(panel, f"always: {QUEUE} < {LEAST} or {FULL} > 2.0", ["false"]) == []
    assert not any(python in panel for python in ("lambda", "s[", "QUEUE"))
    row = page.locator("#panel_failure tr", has_text=QUEUE)
    assert row.locator("td").first.inner_text() == f"{LEAST}"
    page.focus("#scrubber")
    page.keyboard.press("End")
    settled(page)
    assert [cell.inner_text() for cell in row.locator("td").all()] == [f"{LEAST}"] * 2


def test_its_signals_are_on_the_trends_alarms_and_commands_included(page: Any) -> None:
    chips = [" ".join(chip.split()) for chip in page.locator(".chip").all_inner_texts()]
    assert [chip.split()[0] for chip in chips[:2]] == [QUEUE, FULL]
    assert any(chip.startswith(f"{GATE} on") for chip in chips), "the page opens before the gate closes"
    page.focus("#scrubber")
    page.keyboard.press("End")
    settled(page)
    assert page.locator(".chip", has_text=GATE).inner_text().split()[1] == "off"
    assert page.locator(".chip", has_text=FULL).inner_text().split()[1] == "on"


def test_the_time_from_the_last_action_to_the_failure_is_stated(page: Any) -> None:
    facts = page.inner_text("#panel_failure dl")
    failed = float(facts.split("failed\n")[1].split(" s")[0])
    assert missing(facts, f"{GATE} = 0 at 6.00 s", [f"{failed - 6.0:.2f}"]) == []
    assert missing(page.inner_text("#notice"), f"{failed - 6.0:.2f} s after {GATE} = 0") == []
    page.locator("#panel_failure button", has_text=GATE).click()
    settled(page)
    assert float(page.inner_text("#clock").removesuffix(" s")) == pytest.approx(6.0, abs=0.05)
