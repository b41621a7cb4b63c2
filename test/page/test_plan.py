# SPDX-License-Identifier: Apache-2.0
"""The plan: where it opens, selection of devices, the map of the plant, links to a moment, narrow windows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from page.conftest import opened_page
from page.line import LINE, record
from page.pixels import canvas, settled, to_pixels
from page.test_page import clock, press

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.page.one_file import write_page

SELECTED = np.array([0xD1, 0x33, 0x0D])
"""Colour of the outline of the selected device, light."""


@pytest.fixture(scope="module")
def plain(bag: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of a recording in which nothing failed."""
    return write_page(bag, tmp_path_factory.mktemp("plain") / "line.html")


def camera(page: Any) -> list[float]:
    """Return x, y (m), scale (px/m), width and height (px) of the plan."""
    settled(page)
    return [float(part) for part in page.get_attribute("#plan", "data-camera").split()]


def outlined(page: Any, x: float, y: float) -> bool:
    """Return True if the outline of the selected device passes a point of the line."""
    settled(page)
    px, py = (round(part) for part in to_pixels(page, x, y))
    patch = canvas(page)[max(0, py - 3) : py + 4, max(0, px - 3) : px + 4]
    return bool((np.abs(patch - SELECTED) < 30).all(axis=2).any())


def test_a_recording_opens_at_its_fullest_moment_fitted_to_the_window(browser: Any, plain: Path, bag: Path) -> None:
    with open_bag(bag) as opened:
        counts = {round(frame.time, 2): len(frame.data.id) for frame in opened.bottles()}
    with opened_page(browser, plain) as page:
        settled(page)
        most = max(counts.values())
        assert counts[round(clock(page), 2)] >= most - 3 > counts[0.0]  # looks are a second apart; 3 bottles come in it
        _, _, scale, width, height = camera(page)
        assert scale == pytest.approx(min((width - 80) / 4.55, (height - 100) / 2.0), rel=0.1)
        assert page.evaluate("location.hash") == "", "the address changes when the user moves in time"


def test_a_recording_without_bottles_opens_at_its_start(browser: Any, tmp_path: Path) -> None:
    line = tmp_path / "line.yaml"
    text = LINE.read_text()
    line.write_text(text.replace("outputs: {bottles: 50", "outputs: {bottles: 0"))
    html = write_page(record(tmp_path / "bag", 3.0, line=line), tmp_path / "page.html")
    with opened_page(browser, html) as page:
        assert clock(page) == 0.0


@pytest.mark.parametrize("device, at", [
    ("machines/capper", (1.95, 0.05)), ("photo_eyes/exit", (4.45, 1.2)), ("gates/hold", (3.2, -0.1)),
    ("belts/out", (4.5, 1.0)),
])  # fmt: skip
def test_the_selected_device_is_outlined_and_zoomed_to(
    browser: Any, plain: Path, device: str, at: tuple[float, float]
) -> None:
    with opened_page(browser, plain) as page:
        page.uncheck("#names")
        page.uncheck("#forces")
        press(page, "Home")
        assert not outlined(page, *at)
        whole = camera(page)[2]
        page.click("#tab_device")
        page.select_option("#panel_device select", device)
        assert outlined(page, *at)
        page.click("#approach")
        _, _, scale, width, height = camera(page)
        assert scale > 1.05 * whole
        px, py = to_pixels(page, *at)
        assert 0 <= px <= width and 0 <= py <= height
        press(page, "Escape")
        assert not outlined(page, *at)


def test_zooming_to_a_device_needs_a_selection(browser: Any, plain: Path) -> None:
    with opened_page(browser, plain) as page:
        before = camera(page)
        press(page, "g")
        assert "Select" in page.inner_text("#notice") and camera(page) == before


def test_a_press_on_the_map_moves_the_plan_there(browser: Any, plain: Path) -> None:
    with opened_page(browser, plain) as page:
        assert not page.locator("#map").is_visible(), "the window shows the complete plant"
        for _ in range(6):
            page.click("#closer")
        settled(page)
        assert page.locator("#map").is_visible()
        box = page.locator("#map").bounding_box()
        scale = (box["width"] - 12) / 4.55
        page.mouse.click(box["x"] + 6 + scale * 4.4, box["y"] + box["height"] - 6 - scale * 1.5)
        x, y, *_ = camera(page)
        assert x == pytest.approx(4.4, abs=0.15) and y == pytest.approx(1.5, abs=0.15)
        page.click("#fit")
        settled(page)
        assert not page.locator("#map").is_visible()


def test_a_click_prefers_devices_where_bottles_are_small(browser: Any, plain: Path, bag: Path) -> None:
    with opened_page(browser, plain) as page:
        time = clock(page)
        with open_bag(bag) as opened:
            bottles = next(frame.data for frame in opened.bottles() if abs(frame.time - time) < 1e-6)
        index = int(np.argmax((bottles.x > 0.4) & (bottles.x < 1.3)))
        for small in (False, True):
            while small and camera(page)[2] * 0.04 > 5.0:
                page.click("#farther")
            press(page, "Escape")
            x, y = to_pixels(page, bottles.x[index], bottles.y[index])
            page.click("#plan", position={"x": x, "y": y})
            settled(page)
            assert page.get_attribute("#tab_device" if small else "#tab_bottle", "aria-selected") == "true"
        assert page.input_value("#panel_device select") in ("zones/before_capper", "belts/line")


def test_a_link_leads_to_a_moment_and_the_address_is_one(browser: Any, plain: Path) -> None:
    with opened_page(browser, plain, part="#t=12&bottle=9&device=machines/capper") as page:
        settled(page)
        assert clock(page) == 12.0
        assert "id\n9\n" in page.inner_text("#panel_bottle") and page.locator("#panel_bottle").is_visible()
        assert page.input_value("#panel_device select") == "machines/capper"
        press(page, "Escape", "ArrowRight")
        page.wait_for_timeout(800)
        assert page.evaluate("location.hash") == "#t=13"
        page.evaluate("location.hash = '#t=3.5'")
        settled(page)
        assert clock(page) == 3.52 or clock(page) == 3.48, "the frame there"


@pytest.mark.parametrize("part, words", [
    ("#t=abc", ("t=abc", "0.00 s", "24.00 s")), ("#t=25", ("t=25", "24.00 s")), ("#t=", ("t=",)),
    ("#t=NaN", ("t=NaN",)), ("#bottle=-1", ("bottle=-1",)), ("#bottle=1e99x", ("bottle=1e99x",)),
    ("#device=machines/none", ("machines/none",)),
])  # fmt: skip
def test_a_link_that_is_wrong_is_refused(browser: Any, plain: Path, part: str, words: tuple[str, ...]) -> None:
    with opened_page(browser, plain) as page:
        before = clock(page)
    with opened_page(browser, plain, part=part) as page:
        assert all(word in page.inner_text("#notice") for word in words)
        assert page.get_attribute("#news", "class") == "wrong" and clock(page) == before


def test_the_plan_remains_in_a_narrow_window(browser: Any, plain: Path) -> None:
    with opened_page(browser, plain, (390, 844)) as page:
        settled(page)
        box = page.locator("#plan").bounding_box()
        assert box["height"] >= 240 and box["width"] == 390
        assert page.evaluate(
            "document.documentElement.scrollWidth <= innerWidth && document.body.scrollHeight <= innerHeight"
        )
        assert not page.locator("#colour").is_visible()
        page.click("#choices")
        page.select_option("#colour", "force")
        page.click("#choices")
        page.click("#toggle_trends")
        settled(page)
        assert page.locator("#plan").bounding_box()["height"] >= 240
        assert page.locator("#play").is_visible() and page.locator("#scrubber").bounding_box()["width"] > 200


@pytest.mark.parametrize("size", [(390, 844), (820, 1180)], ids=["phone", "tablet"])
def test_touch_targets_have_at_least_40_px(browser: Any, plain: Path, size: tuple[int, int]) -> None:
    context = browser.new_context(
        viewport={"width": size[0], "height": size[1]}, has_touch=True, is_mobile=True, offline=True
    )
    page = context.new_page()
    page.goto(plain.as_uri())
    page.wait_for_selector("body[data-told]", state="attached")
    if size[0] < 600:
        page.tap("#choices")
        page.tap("#toggle_trends")
    for tab in page.locator("[role=tab]").all():
        tab.tap()
        settled(page)
        small = page.evaluate(
            """() => Array.from(document.querySelectorAll("button, select, input, a, [role=slider], [role=button]"))
                .map((one) => one.closest("label") ?? one).filter((one) => one.checkVisibility())
                .map((one) => [one.id || one.textContent, one.getBoundingClientRect()])
                .filter(([, box]) => box.width < 39.5 || box.height < 39.5)
                .map(([name, box]) => `${name}: ${box.width} x ${box.height}`)"""
        )
        assert small == []
    context.close()
