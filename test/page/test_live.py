# SPDX-License-Identifier: Apache-2.0
"""The page of a line that runs, in a real browser: what it shows, what is commanded on it, and who may."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from facts import missing
from page.line import LINE
from page.live_line import (
    SETPOINT,
    SPEED,
    WEB,
    Live,
    clock,
    put_into_mode,
    set_speed,
    show_device,
    sign_in,
    signed_in,
    soon,
    told,
)
from page.pixels import count_where_they_are, settled
from protocols.waiting import until

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.protocols.hosting.serving import Serving
from conveyor_sim.protocols.hosting.settings import ServerSettings
from conveyor_sim.protocols.tags.bag_provider import BagTagProvider
from conveyor_sim.protocols.tags.scene_messages import SceneTask
from conveyor_sim.protocols.tags.scene_provider import SceneTagProvider
from conveyor_sim.scene import load_scene

pytest.importorskip("aiohttp", reason="aiohttp is not installed: pip install conveyor-sim[scada]")


@pytest.fixture
def page(open_page: Callable[[str], Any], live: Live) -> Any:
    return open_page(live.url)


# What is shown


def test_the_picture_follows_the_line_and_says_how_late_it_is(page: Any, live: Live) -> None:
    first = clock(page)
    soon(page, lambda: clock(page) > first + 0.5, "time goes on")
    assert page.inner_text("#link") == "● Live" and page.inner_text("#run") == "running"
    soon(page, lambda: page.inner_text("#latency").endswith(" ms behind"), "how late it is")
    assert page.inner_text("#scene") == "small_packaging" and page.inner_text("#who") == "read only"
    drawn = clock(page)
    assert live.source.snapshot.tick * 0.01 >= drawn - 0.005


def test_bottles_are_drawn_where_the_source_has_them_to_a_pixel(page: Any, live: Live) -> None:
    signed_in(page, "tess")
    until(lambda: live.source.snapshot.tick > 1000, "bottles behind the capper")
    page.click("text=Pause run")
    page.wait_for_selector("text=Resume run")
    until(
        lambda: live.source.frame.drawn["bottles"]().tick == live.source.snapshot.tick, "a picture of where it stands"
    )
    drawn = live.source.frame.drawn["bottles"]()
    soon(
        page, lambda: float(page.get_attribute("#plan", "data-frame")) == pytest.approx(drawn.tick * 0.01), "its frame"
    )
    page.uncheck("#names")
    page.uncheck("#forces")
    settled(page)
    bottles = TOPICS["bottles"].unpack(drawn)
    assert int(page.get_attribute("body", "data-bottles")) == len(bottles.id)
    assert count_where_they_are(page, bottles, lambda x: 2.1 < x < 2.4 or 2.6 < x < 3.5) >= 2
    before = clock(page)
    page.click("text=Step one tick")
    soon(page, lambda: clock(page) == pytest.approx(before + 0.01), "one tick")
    page.click("text=Resume run")
    soon(page, lambda: clock(page) > before + 0.2, "time goes on")


def test_what_was_received_can_be_gone_back_to(page: Any) -> None:
    def drawn() -> bool:
        return int(page.get_attribute("body", "data-bottles") or 0) > 0

    soon(page, drawn, "the first picture")
    first = clock(page)
    soon(page, lambda: clock(page) > first + 1.0, "a second to go back to")
    page.click("#plan", position={"x": 20, "y": 20})
    page.keyboard.press("k")
    stopped = clock(page)
    page.keyboard.press("Home")
    soon(page, lambda: clock(page) < stopped - 0.5 and drawn(), "what was received first")
    soon(page, lambda: page.inner_text("#latency").endswith(" s ago"), "how long ago that was")
    page.click("#follow_now")
    soon(page, lambda: clock(page) > stopped, "it is now again")


def test_hostile_names_are_text_and_a_policy_is_set(page: Any, live: Live) -> None:
    until(
        lambda: "capper_full" in {event.name.removeprefix("alarms/") for event in live.source.events(0)[1]}, "an alarm"
    )
    page.click("#tab_events")
    page.fill("#panel_events input[type=search]", "capper_full")
    soon(page, lambda: "<img src=x onerror=alert(2)>" in page.inner_text("#panel_events"), "the text of the alarm")
    assert page.locator("#panels img").count() == 0
    answer = page.request.get(live.url)
    policy = answer.headers["content-security-policy"]
    assert "default-src 'none'" in policy and "unsafe" not in policy and "frame-ancestors 'none'" in policy


@pytest.mark.parametrize("size", [(1280, 720), (820, 1180)], ids=["laptop", "tablet"])
def test_everything_fits_and_has_a_name_for_those_who_hear_it(page: Any, size: tuple[int, int]) -> None:
    page.set_viewport_size({"width": size[0], "height": size[1]})
    show_device(page, "belts/line")
    assert page.evaluate(
        "document.documentElement.scrollWidth <= innerWidth && document.body.scrollHeight <= innerHeight"
    )
    nameless = page.evaluate(
        """() => Array.from(document.querySelectorAll("button, select, input, canvas[role], [role=slider]"))
            .filter((one) => one.offsetParent && !(one.getAttribute("aria-label") || one.textContent.trim()
                || one.labels?.length || one.title)).map((one) => one.outerHTML)"""
    )
    assert nameless == []
    assert page.locator("#plan").bounding_box()["height"] > 200


# Who may do what


def reason(page: Any, control: str) -> str:
    """Return the reason for which a control is disabled; "" if it is enabled."""
    settled(page)
    text, disabled = page.locator(control).evaluate("(one) => [one.title, one.disabled]")
    assert bool(text) == disabled
    return str(text)


SET = f"[aria-label='Set {SETPOINT} now']"


def test_controls_are_disabled_with_the_reason_before_a_sign_in(page: Any) -> None:
    show_device(page, "belts/line")
    assert missing(reason(page, SET), ["sign in", "operator"]) == []
    assert missing(page.inner_text("#panel_device"), "Sign in as an operator") == []
    for control in ("text=Pause run", "text=Reset run", f"[aria-label='Set {SETPOINT}']"):
        assert missing(reason(page, control), ["sign in"]) == [], control


def test_a_viewer_sees_no_control_enabled(page: Any, live: Live) -> None:
    signed_in(page, "vic")
    page.wait_for_selector("#panel_alarms .alarm", state="attached")
    for tab in ("device", "alarms", "watch"):
        page.click(f"#tab_{tab}")
        settled(page)
        guarded = page.locator(f"#panel_{tab} [data-guarded], #desk [data-guarded]")
        assert guarded.count() > 0 and page.locator("[data-guarded]:enabled").locator("visible=true").count() == 0, tab
    assert missing(reason(page, "text=Reset run"), ["vic", "viewer", "operator"]) == []
    refused = page.evaluate(FORGED, {"do": "control", "names": ["reset"], "values": []})
    assert missing(refused, ["vic", "viewer"]) == [] and live.source.snapshot.run.text == "running"


FORGED = """async (request) => {
    const socket = new WebSocket(new URL("live", location.href.replace("http", "ws")));
    await new Promise((open) => { socket.onopen = open; });
    const replies = [], next = () => new Promise((resolve) => replies.push(resolve));
    socket.onmessage = async ({ data }) => {
        const bytes = new Uint8Array(await data.arrayBuffer());
        if (bytes[0] === 0) {
            const message = JSON.parse(new TextDecoder().decode(bytes.subarray(1)));
            if (message.kind === "reply") replies.shift()?.(message);
        }
    };
    const ask = (what) => { socket.send(JSON.stringify({ ...what, id: 1 })); return next(); };
    await ask({ do: "sign_in", name: "vic", password: "open sesame" });
    const { refused } = await ask(request);
    socket.close();
    return refused;
}"""
"""Sends a request that the page does not offer, as the viewer vic."""


def test_a_wrong_password_is_none(page: Any) -> None:
    sign_in(page, "tess", "open wheat")
    soon(page, lambda: page.inner_text("#signing .wrong") == "name or password are wrong", "the reason")
    assert page.get_attribute("body", "data-person") == ""
    page.click("text=Cancel")


def test_an_operator_is_told_to_change_the_mode_and_a_refusal_goes_when_it_no_longer_holds(page: Any) -> None:
    signed_in(page, "jo")
    show_device(page, "belts/line")
    assert missing(reason(page, SET), "belts/line is in Automatic", ["set", "mode", "Manual", "first"]) == []
    assert missing(reason(page, "[aria-label='Set belts/line/mode'] option[value='2']"), ["engineer"]) == []
    put_into_mode(page, "3")
    soon(page, lambda: reason(page, SET) == "", "it may be set")
    set_speed(page, "7")
    told(page, "Refused: belts/line/cmd_speed: 7 given, expected 0 to 1 m/s")
    page.fill(f"[aria-label='Set {SETPOINT}']", "0.4")
    soon(page, lambda: page.inner_text("#notice") == "", "another value is another request")
    put_into_mode(page, "1")
    soon(page, lambda: reason(page, SET) != "", "automatic again")
    show_device(page, "photo_eyes/exit")
    inject = reason(page, "[aria-label='Inject photo_eyes/exit/stuck_on on']")
    assert missing(inject, ["test", "jo", "operator"]) == []


def test_stop_is_offered_in_automatic_and_comes_before_a_change_of_mode(page: Any, live: Live) -> None:
    signed_in(page, "jo")
    show_device(page, "machines/packer")
    choice, button = (f"[aria-label='Set machines/packer/cntrl_cmd{now}']" for now in ("", " now"))
    options = page.locator(f"{choice} option")
    enabled = [option.inner_text() for option in options.all() if option.is_enabled()]
    assert enabled == ["Stop", "Abort"]
    mode = "[aria-label='Set machines/packer/mode now']"
    assert missing(reason(page, mode), "machines/packer is in", ["Stopped", "mode", "stop it first"]) == []
    page.select_option(choice, label="Stop")
    page.click(button)
    soon(page, lambda: live.source.snapshot.values["machines/packer/state"] == 2.0, "it stops")
    soon(page, lambda: reason(page, mode) == "", "its mode may change")


def test_the_run_has_one_pause_control(page: Any) -> None:
    signed_in(page, "jo")

    def pausing() -> list[str]:
        settled(page)
        buttons = page.locator("button:visible").all()
        named = [f"{one.inner_text()} {one.get_attribute('aria-label') or ''}" for one in buttons]
        return [name.strip() for name in named if "pause" in name.lower() or "❚❚" in name]

    assert pausing() == ["Pause run"]
    page.click("#back")
    page.click("#play")
    assert pausing() == ["Pause run"] and page.get_attribute("#play", "aria-label") == "Stop the replay"
    page.click("#follow_now")


def test_what_one_does_another_sees_and_may_not_undo(open_page: Callable[[str], Any], live: Live) -> None:
    viewer, tester = open_page(live.url), open_page(live.url)
    show_device(viewer, "belts/line")
    field = viewer.locator("[aria-label='Set belts/line/mode']")
    assert field.input_value() == "1"
    signed_in(tester, "tess")
    put_into_mode(tester, "3")
    soon(viewer, lambda: field.input_value() == "3", "the mode, in the field, too")
    assert viewer.locator("[aria-label='Set belts/line/mode now']").is_disabled()
    assert viewer.locator("#panel_device tr", has_text="mode").first.locator("td").inner_text() == "Manual"
    put_into_mode(tester, "1")
    soon(tester, lambda: live.source.snapshot.values["belts/line/mode"] == 1.0, "automatic again")


def test_what_a_tester_does_is_shown(page: Any, live: Live, open_page: Callable[[str], Any]) -> None:
    signed_in(page, "tess")
    show_device(page, "photo_eyes/exit")
    page.click("[aria-label='Watch photo_eyes/exit/blocked']")
    page.click("#tab_watch")
    page.click("[aria-label='Force photo_eyes/exit/blocked on']")
    row, chip = page.locator("#panel_watch li"), page.locator("[aria-label^='Remove photo_eyes/exit/blocked ']")
    soon(page, lambda: "forced" in row.inner_text() and "\non\n" in row.inner_text(), "the force")
    for panel in ("line", "alarms", "events", "device", "bottle", "watch"):
        page.click(f"#tab_{panel}")
        assert missing(page.inner_text("#banner"), "forced photo_eyes/exit/blocked = on") == [], panel
    soon(page, lambda: ", forced" in chip.inner_text(), "the force, of what the trends show")
    page.click("[aria-label='End the force on photo_eyes/exit/blocked']")
    soon(page, lambda: "forced" not in row.inner_text(), "its end")
    soon(page, lambda: "forced" not in chip.inner_text(), "its end, of what the trends show")
    show_device(page, "photo_eyes/exit")
    page.click("[aria-label='Inject photo_eyes/exit/stuck_on on']")
    fault = page.locator("#panel_device tr", has_text="stuck_on").first
    soon(page, lambda: "on" in fault.locator("td").inner_text(), "the fault")
    late = open_page(live.url)
    soon(late, lambda: missing(late.inner_text("#banner"), "fault photo_eyes/exit/stuck_on = on") == [], "the fault")
    page.click("[aria-label='Inject photo_eyes/exit/stuck_on off']")
    soon(page, lambda: "off" in fault.locator("td").inner_text(), "its end")
    soon(page, lambda: not page.locator("#banner").is_visible(), "nothing is forced or faulty")


def test_alarms_are_shelved_acknowledged_and_reset(page: Any) -> None:
    """The photo-eye is forced, so that the alarm does not change by itself in the meantime."""
    signed_in(page, "tess")
    show_device(page, "photo_eyes/queue")
    page.click("[aria-label='Watch photo_eyes/queue/blocked']")
    page.click("#tab_watch")
    page.click("[aria-label='Force photo_eyes/queue/blocked on']")
    page.click("#tab_alarms")
    row = page.locator("#panel_alarms li", has_text="queue_stands")
    page.wait_for_selector(".alarm.error:has-text('queue_stands')")
    page.click("#panel_alarms [aria-label='Shelve 1 min queue_stands']")
    soon(page, lambda: "shelved by web tess" in row.inner_text(), "it is shelved")
    page.click("#panel_alarms [aria-label='Unshelve queue_stands']")
    page.click("#panel_alarms [aria-label='Acknowledge queue_stands']")
    soon(page, lambda: "\nacknowledged by web tess" in row.inner_text(), "it is acknowledged")
    page.click("#tab_watch")
    page.click("[aria-label='Force photo_eyes/queue/blocked off']")
    page.click("#tab_alarms")
    page.click("#panel_alarms [aria-label='Reset queue_stands']")
    soon(page, lambda: row.count() == 0, "it is normal")
    page.click("#tab_watch")
    page.click("[aria-label='End the force on photo_eyes/queue/blocked']")
    soon(page, lambda: "forced" not in page.inner_text("#panel_watch li"), "the end of the force")


def test_a_line_that_has_ended_says_so_and_begins_anew(open_page: Callable[[str], Any], users: Path) -> None:
    with SceneTagProvider(SceneTask(load_scene(LINE, {"duration": 1.0}), None, 0, 1.0, 1), lambda text: None) as source:
        source.wait_for_line()
        with Serving(source, [(WEB, 0)], ServerSettings(users=users / "users")) as serving:
            page = open_page(serving.hosts[0].address)
            page.wait_for_selector("#run.stands:has-text('ended')")
            assert clock(page) == 1.0 and not page.locator("text=Pause run").is_visible()
            signed_in(page, "jo")
            page.click("text=Reset run")
            page.click("text=Reset run: sure?")
            page.wait_for_selector("#run:has-text('paused')")
            page.click("text=Resume run")
            soon(page, lambda: 0.0 < clock(page) < 1.0, "time goes on")


# By other ways


def test_a_command_given_on_the_page_is_in_the_recording_which_replays(
    open_page: Callable[[str], Any], users: Path, tmp_path: Path
) -> None:
    scene = load_scene(LINE, {"duration": 3600.0})
    with SceneTagProvider(SceneTask(scene, tmp_path / "bag", 0, 1.0, 1), lambda text: None) as source:
        source.wait_for_line()
        with Serving(source, [(WEB, 0)], ServerSettings(users=users / "users")) as serving:
            page = open_page(serving.hosts[0].address)
            signed_in(page, "jo")
            put_into_mode(page, "3")
            mode = page.locator("#panel_device tr", has_text="mode").first.locator("td")
            soon(page, lambda: mode.inner_text() == "Manual", "the mode")
            set_speed(page, "0.2")
            soon(page, lambda: source.snapshot.values[SPEED] == 0.2, "the belt is slow")
            row = page.locator("#panel_device tr", has_text="cmd_speed").first
            soon(page, lambda: "by web jo since" in row.inner_text(), "who did it")
            page.locator("#panel_device tr", has_text="by scene since 0.00 s").first.wait_for()
            assert "1 client, 2 written, 0 refused" in serving.progress()
    report = replay(tmp_path / "bag")
    assert report.exact and report.difference is None
    with open_bag(tmp_path / "bag") as bag:
        given = [frame.data for frame in bag.outcomes() if frame.data.source == "web"]
    assert [(one.writer, one.writer_kind, one.accepted) for one in given] == [("web jo", "operator", True)] * 2


def test_a_recording_is_played_on_the_page(open_page: Callable[[str], Any], users: Path, bag: Path) -> None:
    with (
        BagTagProvider(bag, lambda text: None, loop=True) as source,
        Serving(source, [(WEB, 0)], ServerSettings(users=users / "users")) as serving,
    ):
        page = open_page(serving.hosts[0].address)
        soon(page, lambda: int(page.get_attribute("body", "data-bottles") or 0) > 3, "its bottles")  # "": none yet
        page.select_option("#colour", "force")
        weak = page.inner_text("#legend")
        assert source.control("seek", 15.0, "test") == ""
        soon(page, lambda: page.inner_text("#legend") != weak, "the scale of what came since")
        signed_in(page, "tess")
        page.click("text=Pause run")
        page.wait_for_selector("text=Resume run")
        stands = clock(page)
        assert source.control("seek", max(0.0, stands - 0.5), "test") == ""
        soon(page, lambda: clock(page) < stands, "it went back")
        show_device(page, "belts/line")
        assert page.locator(f"[aria-label='Set {SETPOINT}']").count() == 0, "a recording can't be commanded"
