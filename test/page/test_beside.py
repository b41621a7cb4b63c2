# SPDX-License-Identifier: Apache-2.0
"""Two recordings on one page, in a real browser: the same time and zoom, and their first difference said and marked."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from page.conftest import opened_page
from page.line import record
from page.pixels import TYPE_COLOURS, canvas, disc, settled, to_pixels
from page.test_page import clock, press, seek

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.page.one_file import write_page
from conveyor_sim.page.server import RecordingServer

MARK = np.array((0x82, 0x50, 0xDF))
"""Colour of a difference on the scrubber."""


@pytest.fixture(scope="module")
def pair_html(bag: Path, other_bag: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_page(bag, tmp_path_factory.mktemp("pair") / "pair.html", other=other_bag)


@pytest.fixture
def pair(browser: Any, pair_html: Path) -> Iterator[Any]:
    with opened_page(browser, pair_html) as opened:
        opened.wait_for_selector("body[data-compared]")
        settled(opened)
        yield opened


def test_it_opens_before_the_first_difference_and_says_and_marks_it(pair: Any) -> None:
    assert clock(pair) == pytest.approx(4.0, abs=0.05)
    said = "A and B first differ at 6.00 s: in A alone: command gates/hold/open = 0.0 by test"
    assert pair.inner_text("#notice") == said
    rows = pair.locator("#panel_compare .first")
    assert rows.count() == 4 and "gates/hold/is_open is 0 in A, 1 in B" in rows.nth(1).inner_text()
    pixels = canvas(pair, "#scrubber canvas")
    marked = np.flatnonzero((np.abs(pixels - MARK) < 30).all(axis=2).any(axis=0))
    assert np.abs(marked - (8 + 6.0 / 24.0 * (pixels.shape[1] - 16))).min() < 2
    press(pair, "n", "n")
    assert clock(pair) == pytest.approx(6.0, abs=0.05)


def figures(bag: Path, until: float = 24.0) -> list[str]:
    """Return throughput, OEE, peak force and number of alarms of a recording, as the page writes them."""
    left, alarms, oee, peak = 0, 0, 0.0, 0.0
    with open_bag(bag) as opened:
        for frame in opened.read("events"):
            kinds = [kind for at, kind in zip(frame.data.at, frame.data.kind, strict=True) if at * 0.01 <= until]
            left += kinds.count("bottle_removed")
            alarms += kinds.count("alarm_raised")
        for frame in opened.read("counters"):
            if frame.time <= until:
                oee = frame.data.oee[list(frame.data.name).index("line")]
        for frame in opened.bottles():
            if frame.time <= until:
                peak = max(peak, frame.data.peak_force.max(initial=0.0))
    return [f"{round(left * 3600 / until)} /h", f"{100 * oee:.1f} %", f"{float(f'{peak:.3g}'):g} N", f"{alarms}"]


def shown_figures(page: Any, column: int) -> list[str]:
    page.wait_for_selector("body[data-peaks]")
    settled(page)
    rows = page.locator("#panel_compare .figures tr").all()[1:]
    assert [row.locator("th").inner_text() for row in rows] == [
        "throughput", "OEE of the line", "peak force", "alarms raised",
    ]  # fmt: skip
    return [str(row.locator("td").nth(column).inner_text()) for row in rows]


def test_it_leads_with_the_figures_of_both(pair: Any, bag: Path, other_bag: Path) -> None:
    assert [shown_figures(pair, column) for column in (0, 1)] == [figures(bag), figures(other_bag)]
    change = shown_figures(pair, 2)
    assert change[0].startswith("+") and change[1].endswith(" points") and change[3] == "0"
    top, first = (
        pair.locator(f"#panel_compare {part}").bounding_box()["y"] for part in (".figures", ".first >> nth=0")
    )
    assert top < first
    pair.locator("#panel_compare .figures button").click()
    pair.click("#tab_bottle")
    settled(pair)
    assert "speed" in pair.inner_text("#panel_bottle"), "the bottle with the largest force is chosen"


def test_a_click_on_a_difference_goes_there_and_chooses_the_bottle_in_both(pair: Any) -> None:
    row = pair.locator("#panel_compare .first").nth(3)
    bottle = row.inner_text().split("bottle ")[-1].split()[0]
    row.click()
    settled(pair)
    assert clock(pair) > 6.0
    pair.click("#tab_bottle")
    assert f"id\n{bottle}\n" in pair.inner_text("#panel_bottle")


def test_both_are_drawn_at_the_same_time_and_zoom(pair: Any, bag: Path, other_bag: Path) -> None:
    for box in ("#names", "#forces"):
        pair.uncheck(box)
    seek(pair, 9.0)
    place = pair.locator("#plan_other").bounding_box()
    pair.mouse.move(place["x"] + 0.7 * place["width"], place["y"] + 0.7 * place["height"])
    pair.mouse.wheel(0, -300)
    settled(pair)
    time, scale = (
        float(pair.get_attribute("#plan", "data-frame")),
        float(pair.get_attribute("#plan", "data-camera").split()[2]),
    )
    checked = []
    for found, path in (("#plan", bag), ("#plan_other", other_bag)):
        with open_bag(path) as opened:
            bottles = next(frame.data for frame in opened.bottles() if abs(frame.time - time) < 1e-6)
        pixels, count = canvas(pair, found), 0
        for kind, x, y in zip(bottles.type, bottles.x, bottles.y, strict=True):
            px, py = to_pixels(pair, x, y)
            if not (2.7 < x < 3.5 and 20 < px < pixels.shape[1] - 20 and 20 < py < pixels.shape[0] - 20):
                continue  # no mark is drawn over those that are left
            middle = disc(pixels, TYPE_COLOURS[kind], px, py, (0.04, 0.035)[kind] * scale + 1)
            assert np.abs(middle - [px, py]).max() <= 1.0
            count += 1
        checked.append(count)
    assert min(checked) >= 2
    assert not np.array_equal(canvas(pair, "#plan"), canvas(pair, "#plan_other"))


def test_what_differs_now_is_listed_coloured_and_put_on_the_trends(pair: Any) -> None:
    seek(pair, 3.0)
    assert "No signal differs." in pair.inner_text("#panel_compare")
    seek(pair, 9.0)
    row = pair.locator("#panel_compare tr", has_text="counters/middle/forward")
    here, there = (int(cell.inner_text()) for cell in row.locator("td").all())
    assert here < there, "the gate holds back those that were to come"
    assert "more than 1 mm apart" in pair.inner_text("#panel_compare")
    row.get_by_role("button").click()
    assert pair.locator(".chip", has_text="counters/middle/forward").count() == 1
    pair.select_option("#colour", "apart")
    settled(pair)
    assert "50 mm" in pair.inner_text("#legend")


def test_machines_alarms_and_devices_are_those_of_both(pair: Any) -> None:
    seek(pair, 9.0)
    pair.click("#tab_line")
    heads = ["MACHINES OF A", "MACHINES OF B", "PRODUCTION OF A", "PRODUCTION OF B"]
    assert pair.locator("#panel_line h2").all_inner_texts() == heads
    pair.click("#tab_alarms")
    assert pair.locator("#panel_alarms h2").all_inner_texts() == ["ALARMS OF A", "ALARMS OF B"]
    assert pair.locator("#panel_alarms .alarm", has_text="capper_full").count() == 2
    pair.click("#tab_device")
    pair.select_option("#panel_device select", "gates/hold")
    settled(pair)
    row = pair.locator("#panel_device tr", has=pair.get_by_role("button", name="is_open"))
    assert row.locator("td").all_inner_texts() == ["off", "on"]
    row = pair.locator("#panel_device tr", has=pair.locator("th", has_text="open by test"))
    assert row.count() == 0
    assert "A: by test since 6" in pair.inner_text("#panel_device")
    for panel, head in (("events", "EVENTS OF A"), ("bottle", "BOTTLE OF A")):
        pair.click(f"#tab_{panel}")
        assert pair.inner_text(f"#panel_{panel} h2") == head


def test_it_fits_a_tablet_with_one_plan_above_the_other_or_beside(pair: Any) -> None:
    pair.set_viewport_size({"width": 820, "height": 1180})
    settled(pair)
    boxes = [pair.locator(found).bounding_box() for found in ("#plan", "#plan_other")]
    assert boxes[0]["width"] == boxes[1]["width"] and boxes[0]["height"] == boxes[1]["height"]
    assert pair.evaluate(
        "document.documentElement.scrollWidth <= innerWidth && document.body.scrollHeight <= innerHeight"
    )


def test_a_served_pair_finds_the_same_and_goes_on_where_one_has_ended(browser: Any, bag: Path, tmp_path: Path) -> None:
    short = record(tmp_path / "bag", 8.0, closes=False)
    with RecordingServer(short, other=bag) as server:
        page = browser.new_page(viewport={"width": 1280, "height": 720})
        page.goto(server.url)
        page.wait_for_selector("body[data-compared]", timeout=60_000)
        assert page.inner_text("#notice").startswith(
            "A and B first differ at 6.00 s: in B alone: command gates/hold/open"
        )
        assert shown_figures(page, 1) == figures(bag, 8.0), "the part that both have"
        page.click("#plan", position={"x": 20, "y": 20})
        press(page, "End")
        assert clock(page) == pytest.approx(24.0, abs=0.05)
        page.locator(".caption", has_text="ended at 8.00 s").wait_for(timeout=60_000)
        assert "ended" not in page.locator(".caption").nth(1).inner_text()
        page.close()


def test_two_equal_recordings_are_said_to_be_equal(browser: Any, tmp_path: Path) -> None:
    bag = record(tmp_path / "bag", 1.0)
    html = write_page(bag, tmp_path / "page.html", other=bag)
    with opened_page(browser, html) as page:
        page.wait_for_selector("body[data-compared]")
        assert page.inner_text("#notice") == "A and B are equal up to 1.00 s, bit for bit"
