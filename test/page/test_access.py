# SPDX-License-Identifier: Apache-2.0
"""The page for those without a mouse, or who see little: what is clicked is reached by Tab, has a name, stands out."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from page.conftest import opened_page
from page.live_line import PASSWORD, Live, show_device, signed_in, soon
from page.test_page import clock, press, settled
from protocols.waiting import until

from conveyor_sim.page.bundle import text
from conveyor_sim.page.one_file import FailedCondition, write_page

PANELS = ("line", "alarms", "events", "device", "bottle")

CLICKABLE = """() => Array.from(document.querySelectorAll("body *")).filter((one) => {
    const style = getComputedStyle(one);
    return one.checkVisibility() && ["pointer", "grab", "crosshair"].includes(style.cursor)
        && !["pointer", "grab", "crosshair"].includes(getComputedStyle(one.parentElement).cursor);
})"""

BEGIN = f"""() => {{
    const instead = (one) => {{
        if (one.closest("[role=tablist]")) return document.querySelector("[role=tab][tabindex='0']");
        return one.closest("label") ? one.closest("label").control : one;
    }};
    window.wanted = new Set(({CLICKABLE})().map(instead));
    window.reached = new Set();
    document.activeElement.blur();
    return window.wanted.size;
}}"""

SEEN = """() => {
    const one = document.activeElement, before = window.reached.has(one);
    window.reached.add(one);
    return before;
}"""

MISSED = """() => Array.from(window.wanted).filter((one) => !window.reached.has(one))
    .map((one) => one.outerHTML.slice(0, 200))"""

NAMELESS = """() => Array.from(window.reached).filter((one) => one !== document.body
    && !["aria-label", "aria-labelledby"].some((name) => one.getAttribute(name)) && !one.textContent.trim()
    && !one.labels?.length).map((one) => one.outerHTML.slice(0, 200))"""

FAINT = """() => {
    const channels = (text) => (text.match(/[\\d.]+/g) ?? []).map(Number);
    const light = (colour) => colour.slice(0, 3).map((part) => part / 255)
        .map((part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4))
        .reduce((sum, part, k) => sum + part * [0.2126, 0.7152, 0.0722][k], 0);
    const over = (top, alpha, bottom) => bottom.map((part, k) => alpha * top[k] + (1 - alpha) * part);
    const ground = (one) => {
        if (!one) return [255, 255, 255];
        const [red, green, blue, alpha = 1] = channels(getComputedStyle(one).backgroundColor);
        return alpha === 1 ? [red, green, blue] : over([red, green, blue], alpha, ground(one.parentElement));
    };
    const contrast = (a, b) => {
        const [high, low] = [light(a), light(b)].sort((x, y) => y - x);
        return (high + 0.05) / (low + 0.05);
    };
    const found = [];
    for (const one of document.querySelectorAll("body *")) {
        const own = Array.from(one.childNodes).some((node) => node.nodeType === 3 && node.data.trim());
        if (!own || !one.checkVisibility() || one.closest(".unseen, noscript, script, option")) continue;
        const style = getComputedStyle(one), size = parseFloat(style.fontSize), bold = +style.fontWeight >= 700;
        let opacity = 1;
        for (let up = one; up; up = up.parentElement) opacity *= +getComputedStyle(up).opacity;
        const paper = ground(one), ink = over(channels(style.color).slice(0, 3), opacity, paper);
        const least = size >= 24 || (bold && size >= 18.66) ? 3 : 4.5;
        const is = contrast(ink, paper);
        const said = one.textContent.slice(0, 30);
        if (is < least) found.push(`${one.tagName}.${one.className} "${said}" ${is.toFixed(2)}`);
    }
    for (const one of document.querySelectorAll("button, select, input")) {
        const style = getComputedStyle(one), edge = channels(style.borderTopColor);
        if (!one.checkVisibility() || one.matches("[type=checkbox], .link, .quiet, .rows button, [role=tab]")) continue;
        const is = contrast(edge.slice(0, 3), ground(one.parentElement));
        if (is < 3) found.push(`edge of ${one.tagName}#${one.id} ${is.toFixed(2)}`);
    }
    return found;
}"""


@pytest.fixture(scope="module")
def html(bag: Path, other_bag: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    failures = [FailedCondition(22.0, "always: no more than 20 bottles")]
    return write_page(bag, tmp_path_factory.mktemp("access") / "pair.html", failures=failures, other=other_bag)


@pytest.fixture
def pair(browser: Any, html: Path) -> Iterator[Any]:
    with opened_page(browser, html) as page:
        page.wait_for_selector("body[data-compared]")
        yield page


def go_through(page: Any, panel: str) -> None:
    """By Tab, past all that can be clicked while a panel is open."""
    page.click(f"#tab_{panel}")
    settled(page)
    assert page.evaluate(BEGIN) > 15
    for _ in range(400):
        page.keyboard.press("Tab")
        if page.evaluate(SEEN):
            break
    assert page.evaluate(MISSED) == [], panel
    assert page.evaluate(NAMELESS) == [], panel


def test_tab_reaches_all_that_is_clicked_and_each_has_a_name(pair: Any) -> None:
    for panel in ("compare", *PANELS):
        go_through(pair, panel)


def test_so_it_does_on_a_line_that_runs_for_one_who_may_command_it(open_page: Callable[[str], Any], live: Live) -> None:
    page = open_page(live.url)
    signed_in(page, "tess")
    page.wait_for_selector("#panel_alarms .alarm", state="attached")
    page.focus("text=Pause run")
    page.keyboard.press("Enter")
    page.wait_for_selector("text=Resume run")
    show_device(page, "photo_eyes/exit")
    page.focus("[aria-label='Watch photo_eyes/exit/blocked']")
    page.keyboard.press("Enter")
    page.focus("#plan")
    page.keyboard.press("b")
    for panel in (*PANELS, "watch"):
        go_through(page, panel)
    page.focus("text=Resume run")
    page.keyboard.press(" ")
    page.wait_for_selector("text=Pause run")


def test_a_line_that_runs_is_commanded_by_keys_alone(open_page: Callable[[str], Any], live: Live) -> None:
    page = open_page(live.url)
    page.focus("#sign")
    page.keyboard.press("Enter")
    for said in ("tess", PASSWORD):
        page.keyboard.type(said)
        page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    page.wait_for_selector("body[data-person=tess]")
    show_device(page, "photo_eyes/exit")
    for value, now in (("on", 1.0), ("off", 0.0)):
        page.focus(f"[aria-label='Inject photo_eyes/exit/stuck_on {value}']")
        page.keyboard.press("Enter")
        soon(page, lambda now=now: live.source.snapshot.values["photo_eyes/exit/blocked"] == now, value)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_texts_and_edges_stand_out_from_what_is_behind_them(pair: Any, theme: str) -> None:
    pair.evaluate("(theme) => { document.documentElement.dataset.theme = theme; }", theme)
    pair.focus("#scrubber")
    press(pair, "5")  # alarms stand, and events have been and will be
    for panel in ("compare", *PANELS):
        pair.click(f"#tab_{panel}")
        pair.mouse.move(400, 300)
        settled(pair)
        until(lambda: pair.evaluate("!document.getAnimations().length"), "colours of what was hovered go back")
        assert pair.evaluate(FAINT) == [], panel
    press(pair, "?")
    assert pair.evaluate(FAINT) == []


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_colours_of_names_on_the_plan_stand_out_from_their_halo(theme: str) -> None:
    table = text("colours.js").split(f"const {theme.upper()} = {{")[1].split("};")[0]
    colours = dict(re.findall(r'(\w+): "(#\w+)"', table))

    def light(colour: str) -> float:
        parts = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
        linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
        return sum(weight * part for weight, part in zip((0.2126, 0.7152, 0.0722), linear, strict=True))

    for part in ("ink", "muted", "mover", "eye", "lit", "zone", "passage", "select"):
        low, high = sorted((light(colours[part]), light(colours["halo"])))
        assert (high + 0.05) / (low + 0.05) >= 4.5, part


def test_what_has_the_focus_keeps_it_when_a_list_is_written_anew(pair: Any) -> None:
    for panel, row in (("alarms", ".alarm"), ("events", ".event"), ("compare", ".first")):
        pair.focus("#scrubber")
        press(pair, "5")
        pair.click(f"#tab_{panel}")
        found = pair.locator(f"#panel_{panel} {row}").first
        key = found.get_attribute("data-key")
        assert key, panel
        found.focus()
        press(pair, "Enter")
        assert pair.evaluate("document.activeElement.dataset.key") == key, panel


def test_changes_of_states_are_gone_through_by_enter_on_the_bars(pair: Any) -> None:
    pair.click("#tab_line")
    pair.focus("#scrubber")
    press(pair, "Home")
    pair.focus(".bars")
    times = []
    for _ in range(3):
        press(pair, "Enter")
        times.append(clock(pair))
    assert 0.0 < times[0] < times[1] < times[2]
