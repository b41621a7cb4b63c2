# SPDX-License-Identifier: Apache-2.0
"""Layouts that are saved in the browser, and the strip of key figures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from facts import missing
from page.pixels import settled
from page.test_page import press, seek

from conveyor_sim.bag.reader import open_bag

KEY = "layouts of bottling/line_1"


def save(page: Any, name: str) -> None:
    page.click("#arrange")
    page.fill("#layouts input", name)
    page.click("#layouts form button")
    page.locator("#layouts").get_by_role("button", name="Close").click()


def show(page: Any, name: str) -> None:
    page.click("#arrange")
    page.click(f"[aria-label='Show {name}']")
    settled(page)


def camera(page: Any) -> list[float]:
    return [float(part) for part in page.get_attribute("#plan", "data-camera").split()][:3]


def test_a_saved_layout_is_shown_again_after_the_page_was_opened_anew(page: Any) -> None:
    page.fill("#trendbar input", "zones/before_capper/bottles")
    press(page, "Enter")
    page.select_option("#trendbar select", "60")
    page.select_option("#colour", "force")
    page.uncheck("#names")
    page.click("#tab_device")
    page.select_option("#panel_device select", "machines/capper")
    page.click("#theme")
    press(page, "+", "+")
    looked = camera(page)
    chips = page.locator(".chip").all_inner_texts()
    save(page, "capper <b>")
    page.reload()
    page.wait_for_selector("body[data-ready]")
    settled(page)
    assert page.locator(".chip").all_inner_texts() != chips
    show(page, "capper <b>")
    assert page.locator(".chip").all_inner_texts() == chips
    assert page.input_value("#trendbar select") == "60" and page.input_value("#colour") == "force"
    assert not page.is_checked("#names") and page.is_visible("#panel_device")
    assert page.input_value("#panel_device select") == "machines/capper"
    assert page.get_attribute("html", "data-theme") == "dark"
    assert camera(page) == pytest.approx(looked)
    page.click("#arrange")
    page.click("[aria-label='Delete capper <b>']")
    assert missing(page.inner_text("#layouts"), ["no", "layout"]) == []


def stored(page: Any, text: str) -> None:
    page.evaluate("([key, text]) => localStorage.setItem(key, text)", [KEY, text])


@pytest.mark.parametrize("text", ["{", "[]", "7", '{"a": 3}'])
def test_damaged_layouts_are_reported_and_replaced_by_the_next_one(page: Any, text: str) -> None:
    stored(page, text)
    page.click("#arrange")
    assert missing(page.inner_text("#layouts .wrong"), ["damaged"]) == []
    page.fill("#layouts input", "new")
    page.click("#layouts form button")
    assert page.locator("[aria-label='Show new']").count() == 1
    assert page.inner_text("#layouts .wrong") == ""


def test_a_layout_of_another_line_leaves_out_what_is_absent_and_names_it(page: Any) -> None:
    layout = {
        "trends": ["belts/line/speed", "belts/none/speed", 7],
        "window": "long",
        "camera": [1, None],
        "tab": "none",
    }
    stored(page, json.dumps({"odd": {**layout, "colour": {}, "names": "no", "theme": 3, "device": None}}))
    show(page, "odd")
    assert [chip.split()[0] for chip in page.locator(".chip").all_inner_texts()] == ["belts/line/speed"]
    assert missing(page.inner_text("#notice"), ["belts/none/speed"]) == []


def test_a_browser_without_room_for_a_layout_says_so(page: Any) -> None:
    page.evaluate(
        """() => {
            for (let size = 8e6; size >= 1; size /= 2) {
                try { localStorage.setItem(`filler ${size}`, "x".repeat(size)); } catch { /* no room */ }
            }
        }"""
    )
    page.click("#arrange")
    page.fill("#layouts input", "new")
    page.click("#layouts form button")
    assert missing(page.inner_text("#layouts .wrong"), ["saved", "room"]) == []


def test_the_strip_states_the_key_figures_at_the_displayed_time(page: Any, bag: Path) -> None:
    with open_bag(bag) as opened:
        events = [
            (int(at) * 0.01, kind, name)
            for frame in opened.read("events")
            for at, kind, name in zip(frame.data.at, frame.data.kind, frame.data.name, strict=True)
        ]
        oee = {frame.time: frame.data.oee[list(frame.data.name).index("line")] for frame in opened.read("counters")}
    for time in (8.0, 20.0):
        seek(page, time)
        shown = float(page.inner_text("#clock").removesuffix(" s"))
        left = sum(at <= shown and kind == "bottle_removed" and name == "machines/packer" for at, kind, name in events)
        strip = page.inner_text("#kpi")
        recent = [f"OEE {100 * share:.1f} %" for at, share in oee.items() if shown - 2.1 < at <= shown]
        assert missing(strip, f"throughput {round(left * 3600 / shown)} /h") == []
        assert any(text in strip for text in recent)
        assert missing(strip, f"bottles {page.get_attribute('body', 'data-bottles')}") == []
    page.click("#kpi button:has-text('alarms')")
    assert page.locator("#panel_alarms .alarm:not(.gone)").count() == int(strip.split("alarms ")[1].split()[0])
