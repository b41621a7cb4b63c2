# SPDX-License-Identifier: Apache-2.0
"""The operator panel on the page of a running line and of a recording, in a real browser."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from facts import missing
from page.conftest import opened_page
from page.live_line import Live, signed_in, soon
from protocols.waiting import until

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.line.commands.inputs import SET, Input
from conveyor_sim.page.one_file import write_page
from conveyor_sim.protocols.tags.scene_messages import SceneTask
from conveyor_sim.protocols.tags.scene_provider import SceneTagProvider
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.resources import scene_path

pytest.importorskip("aiohttp", reason="aiohttp is not installed: pip install conveyor-sim[scada]")

SCENE = scene_path("scenarios/panel_line")
START, MUSHROOM = "[data-part=start] .push", "[data-part=estop] .mushroom"


@pytest.fixture(scope="module")
def panel(users: Path) -> Iterator[Live]:
    """The line with a panel, in real time; its end is an hour away."""
    scene = load_scene(SCENE, {"duration": 3600.0, "panel": {"pump": {"kind": "button", "action": "maintained"}}})
    with SceneTagProvider(SceneTask(scene, None, 0, 1.0, 1), lambda text: None) as source:
        source.wait_for_line()
        made = Live(users, source)
        made.serve()
        yield made
        made.end()


@pytest.fixture
def page(open_page: Callable[[str], Any], panel: Live) -> Any:
    opened = open_page(panel.url)
    signed_in(opened, "jo")
    opened.wait_for_selector(f"{START}:enabled")  # a disabled button takes no focus
    return opened


def value(panel: Live, name: str) -> float:
    return panel.source.snapshot.values[f"panel/{name}"]


def reads(panel: Live, name: str, expected: float) -> None:
    until(lambda: value(panel, name) == expected, f"{name} is {expected:g}")


def test_a_button_is_pressed_while_it_is_held(page: Any, panel: Live) -> None:
    page.hover(START)
    page.mouse.down()
    reads(panel, "start/contact", 1.0)
    soon(page, lambda: page.get_attribute(START, "aria-pressed") == "true", "its look")
    assert page.inner_text("[data-part=start] .state") == "pressed"
    page.mouse.up()
    reads(panel, "start/contact", 0.0)
    soon(page, lambda: page.inner_text("[data-part=start] .state") == "released", "its look")


@pytest.mark.parametrize("key", ["Space", "Enter"])
def test_a_button_is_pressed_by_keys(page: Any, panel: Live, key: str) -> None:
    page.focus(START)
    page.keyboard.down(key)
    reads(panel, "start/contact", 1.0)
    page.keyboard.up(key)
    reads(panel, "start/contact", 0.0)


def test_a_maintained_button_changes_with_each_click(page: Any, panel: Live) -> None:
    for contact, state in ((1.0, "pressed"), (0.0, "released")):
        page.click("[data-part=pump] .push")
        reads(panel, "pump/contact", contact)
        soon(page, lambda state=state: page.inner_text("[data-part=pump] .state") == state, "its look")


def test_an_emergency_stop_latches_and_is_reset(page: Any, panel: Live) -> None:
    reset = "[aria-label='Reset Emergency stop']"
    assert page.locator(reset).is_hidden()
    page.focus(MUSHROOM)
    page.keyboard.press("Enter")
    reads(panel, "estop/contact", 0.0)
    soon(page, lambda: "latched" in page.inner_text("[data-part=estop] .state"), "its look")
    assert page.get_attribute(MUSHROOM, "aria-pressed") == "true"
    page.click(reset)
    reads(panel, "estop/contact", 1.0)
    soon(page, lambda: page.locator(reset).is_hidden(), "its look")


def test_selector_and_number(page: Any, panel: Live) -> None:
    page.click("[aria-label='mode: off']")
    reads(panel, "mode/position", 0.0)
    soon(page, lambda: page.get_attribute("[aria-label='mode: off']", "aria-pressed") == "true", "its look")
    page.fill("[data-part=speed] input", "0.4")
    page.keyboard.press("Enter")
    reads(panel, "speed/value", 0.4)
    soon(page, lambda: page.inner_text("[data-part=speed] .display") == "0.4 m/s", "its look")
    page.fill("[data-part=speed] input", "7")
    page.click("[aria-label='Enter Belt speed']")
    soon(page, lambda: missing(page.inner_text("#notice"), "panel/speed/set", "0.1", "0.5") == [], "the refusal")
    assert value(panel, "speed/value") == 0.4


def test_a_lit_lamp_has_a_text_and_a_shape(page: Any, panel: Live) -> None:
    panel.source.give(Input("test", "test", "test", SET, ("panel/ready/on", "panel/stack/red"), (1.0, 1.0)))
    soon(page, lambda: page.inner_text("[data-part=ready] .state") == "on", "a lamp that is on")
    texts = page.locator("[data-part=stack] .state").all_inner_texts()
    assert texts == ["red on", "yellow off", "green off"]
    lit, dark = (page.locator("[data-part=stack] .light").nth(k) for k in (0, 1))
    look = "one => [getComputedStyle(one).borderStyle, one.getAttribute('aria-label')]"
    assert lit.evaluate(look) == ["solid", "Line red on"] and dark.evaluate(look) == ["dashed", "Line yellow off"]


def test_a_viewer_uses_nothing(open_page: Callable[[str], Any], panel: Live) -> None:
    guest = open_page(panel.url)
    soon(guest, lambda: guest.locator(START).is_disabled(), "a disabled button")
    assert missing(guest.inner_text("#operator .reason"), "Sign in", "operator") == []
    signed_in(guest, "vic")
    soon(guest, lambda: "vic" in guest.inner_text("#operator .reason"), "the reason")
    assert all(guest.locator("#operator button").nth(k).is_disabled() for k in range(5))


def test_a_recording_shows_the_panel(browser: Any, tmp_path: Path) -> None:
    simulation = Simulation(load_scene(SCENE))
    with Recorder(tmp_path / "bag") as recorder:
        outputs = OutputWriter(simulation, [recorder], run_id="run")
        outputs.start()
        for tick in range(150):
            if tick == 100:
                simulation.give(Input("operate", "jo", "operator", SET, ("panel/estop/press",), (1.0,)))
                simulation.command(["panel/stack/red"], [1.0], "test")
            simulation.advance()
            outputs.after_tick()
    with opened_page(browser, write_page(tmp_path / "bag", tmp_path / "line.html"), part="#t=0.5") as page:
        soon(page, lambda: page.inner_text("[data-part=estop] .state") == "released", "the panel at 0.5 s")
        assert page.locator(MUSHROOM).is_disabled()
        page.focus("#scrubber")
        page.keyboard.press("End")
        soon(page, lambda: "latched" in page.inner_text("[data-part=estop] .state"), "the panel at the end")
        assert page.locator("[data-part=stack] .state").all_inner_texts()[0] == "red on"
        for size in ((900, 700), (1000, 500)):  # a tablet across: panel, plan, trends and tabs do not fit at once
            page.set_viewport_size({"width": size[0], "height": size[1]})
            soon(page, lambda: page.locator("#plan").bounding_box()["height"] >= 220, "a plan with room")


def test_a_line_without_a_panel_has_no_room_for_one(browser: Any, html: Path) -> None:
    with opened_page(browser, html) as page:
        assert page.locator("#operator").is_hidden()
        assert page.evaluate("document.querySelector('#stage').getBoundingClientRect().left") == 0


def test_a_button_is_released_when_its_page_closes(open_page: Callable[[str], Any], panel: Live) -> None:
    page = open_page(panel.url)
    signed_in(page, "jo")
    page.hover(START)
    page.mouse.down()
    reads(panel, "start/contact", 1.0)
    page.close()
    reads(panel, "start/contact", 0.0)


def test_a_button_is_released_when_its_server_is_killed(page: Any, panel: Live) -> None:
    page.hover(START)
    page.mouse.down()
    reads(panel, "start/contact", 1.0)
    assert panel.serving is not None
    os.kill(panel.serving.hosts[0].pid, signal.SIGKILL)
    reads(panel, "start/contact", 0.0)
