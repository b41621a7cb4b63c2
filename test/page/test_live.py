"""The page of a line that runs, in a real browser: what it shows, what is commanded on it, and who may."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
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


def test_who_has_not_signed_in_is_refused_with_the_reason(page: Any, live: Live) -> None:
    set_speed(page, "0.3")
    told(page, "Refused: not signed in")
    assert live.source.snapshot.values[SETPOINT] == 0.5


def test_a_viewer_is_refused_with_the_reason(page: Any, live: Live) -> None:
    signed_in(page, "vic")
    set_speed(page, "0.3")
    told(page, "Refused: vic is a viewer, who only reads")
    page.click("text=Pause run")
    told(page, "vic is a viewer")
    assert live.source.snapshot.values[SETPOINT] == 0.5 and live.source.snapshot.run.text == "running"
    page.click("#sign")
    page.wait_for_selector("body[data-person='']")


def test_a_wrong_password_is_none(page: Any) -> None:
    sign_in(page, "tess", "open wheat")
    soon(page, lambda: page.inner_text("#signing .wrong") == "name or password are wrong", "the reason")
    assert page.get_attribute("body", "data-person") == ""
    page.click("text=Cancel")


def test_an_operator_is_refused_in_automatic_and_for_what_is_out_of_range(page: Any, live: Live) -> None:
    signed_in(page, "jo")
    set_speed(page, "0.3")
    told(page, "Refused: belts/line: is in Automatic")
    set_speed(page, "7")
    told(page, "Refused: belts/line/cmd_speed: 7 given, expected 0 to 1 m/s")
    show_device(page, "photo_eyes/exit")
    page.click("[aria-label='Inject photo_eyes/exit/stuck_on on']")
    told(page, "Refused: inject: given by operator web jo, expected one of the kind test")
    put_into_mode(page, "2")
    told(page, "Refused: belts/line: Maintenance is not for operators")  # by the line, a tick later


def test_what_one_does_another_sees_and_may_not_undo(open_page: Callable[[str], Any], live: Live) -> None:
    viewer, tester = open_page(live.url), open_page(live.url)
    signed_in(viewer, "vic")
    show_device(viewer, "belts/line")
    field = viewer.locator("[aria-label='Set belts/line/mode']")
    assert field.input_value() == "1"
    signed_in(tester, "tess")
    put_into_mode(tester, "3")
    soon(viewer, lambda: field.input_value() == "3", "the mode, in the field, too")
    put_into_mode(viewer, "1")
    told(viewer, "Refused: vic is a viewer")
    assert viewer.locator("#panel_device tr", has_text="mode").first.locator("td").inner_text() == "Manual"
    put_into_mode(tester, "1")
    soon(tester, lambda: live.source.snapshot.values["belts/line/mode"] == 1.0, "automatic again")


def test_what_a_tester_does_is_shown(page: Any, live: Live) -> None:
    signed_in(page, "tess")
    show_device(page, "photo_eyes/exit")
    page.click("[aria-label='Watch photo_eyes/exit/blocked']")
    page.click("#tab_watch")
    page.click("[aria-label='Force photo_eyes/exit/blocked on']")
    row, chip = page.locator("#panel_watch li"), page.locator("[aria-label^='Remove photo_eyes/exit/blocked ']")
    soon(page, lambda: "forced" in row.inner_text() and "\non\n" in row.inner_text(), "the force")
    soon(page, lambda: ", forced" in chip.inner_text(), "the force, of what the trends show")
    page.click("[aria-label='End the force on photo_eyes/exit/blocked']")
    soon(page, lambda: "forced" not in row.inner_text(), "its end")
    soon(page, lambda: "forced" not in chip.inner_text(), "its end, of what the trends show")
    show_device(page, "photo_eyes/exit")
    page.click("[aria-label='Inject photo_eyes/exit/stuck_on on']")
    fault = page.locator("#panel_device tr", has_text="stuck_on").first
    soon(page, lambda: "on" in fault.locator("td").inner_text(), "the fault")
    page.click("[aria-label='Inject photo_eyes/exit/stuck_on off']")
    soon(page, lambda: "off" in fault.locator("td").inner_text(), "its end")


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
