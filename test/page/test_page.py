# SPDX-License-Identifier: Apache-2.0
"""The page in a real browser: its states are reached by clicks and keys, and looked at as a document and as pixels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from facts import missing
from page.conftest import opened_page
from page.line import LINE, record
from page.pixels import canvas, count_where_they_are, settled, to_pixels

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.page.one_file import write_page


def clock(page: Any) -> float:
    return float(page.inner_text("#clock").removesuffix(" s"))


def press(page: Any, *keys: str) -> None:
    for key in keys:
        page.keyboard.press(key)
    settled(page)


def seek(page: Any, time: float) -> None:
    """Click the scrubber where a time is."""
    box = page.locator("#scrubber").bounding_box()
    page.mouse.click(box["x"] + 8 + time / 24.0 * (box["width"] - 16), box["y"] + box["height"] / 2)
    settled(page)


@pytest.mark.parametrize("at", [7.2, 12.8], ids=["late in a block, behind a machine that holds bottles", "in between"])
def test_bottles_are_drawn_where_the_topic_has_them_to_a_pixel(page: Any, bag: Path, at: float) -> None:
    page.uncheck("#names")
    page.uncheck("#forces")
    seek(page, at)
    time = float(page.get_attribute("#plan", "data-frame"))
    with open_bag(bag) as opened:
        frames = [frame for frame in opened.bottles() if abs(frame.time - time) < 1e-6]
    assert len(frames) == 1, "the time is that of a recorded frame"
    bottles = frames[0].data
    assert int(page.get_attribute("body", "data-bottles")) == len(bottles.id)
    assert clock(page) == pytest.approx(time, abs=0.005)
    assert count_where_they_are(page, bottles, lambda x: 2.15 < x < 2.4 or 2.6 < x < 3.1) >= 2


def test_frames_are_stepped_one_at_a_time_forward_and_back(page: Any) -> None:
    seek(page, 12.8)  # where no mark takes the click
    before = clock(page)
    press(page, ".")
    assert clock(page) == pytest.approx(before + 0.04, abs=1e-6)
    press(page, ",", ",")
    assert clock(page) == pytest.approx(before - 0.04, abs=1e-6)


def test_time_is_played_and_paused_by_button_and_key(page: Any) -> None:
    page.select_option("#speed", "10")
    press(page, "Home")
    assert clock(page) == 0.0
    page.click("#play")
    for _ in range(600):  # the page's policy forbids what the browser's driver would wait with
        if clock(page) > 2.0:
            break
        page.wait_for_timeout(100)
    assert clock(page) > 2.0
    assert page.get_attribute("#play", "aria-label") == "Pause"
    page.click("#plan", position={"x": 20, "y": 20})
    press(page, "k")
    stopped = clock(page)
    for _ in range(10):  # enough frames to show a time that goes on
        settled(page)
    assert clock(page) == stopped
    press(page, "End")
    assert clock(page) == 24.0


@pytest.mark.parametrize("clicked", ["#to_start", "#tab_events", "#panel_events .event >> nth=0"])
def test_the_space_key_plays_after_a_click_on_a_button(page: Any, clicked: str) -> None:
    page.click("#tab_events")
    page.click(clicked)
    settled(page)
    before = clock(page)
    press(page, "Space")
    assert page.get_attribute("#play", "aria-label") == "Pause"
    press(page, "Space")
    assert page.get_attribute("#play", "aria-label") == "Play" and clock(page) >= before
    page.keyboard.press("Tab")
    page.focus("#back")
    page.keyboard.press("Space")
    settled(page)
    assert clock(page) < max(before, 24.0) and page.get_attribute("#play", "aria-label") == "Play"


def test_the_page_opens_before_what_failed_and_says_it_as_text(page: Any) -> None:
    assert clock(page) == pytest.approx(17.0, abs=0.05)
    assert page.inner_text("#notice") == "always: no more than 20 bottles <script>alert(3)</script>"
    assert page.get_attribute("#news", "class") == "wrong"
    press(page, "Home", "n")
    assert page.inner_text("#notice").startswith("fault") and page.get_attribute("#news", "class") == ""


def test_a_failure_covers_no_part_of_the_plant(page: Any) -> None:
    news, plan = page.locator("#news").bounding_box(), page.locator("#plan").bounding_box()
    _, top = to_pixels(page, 4.5, 1.95)  # upper end of the belts
    assert news["y"] + news["height"] <= plan["y"] + top


def test_what_is_to_be_noticed_is_whole_and_dismissed(page: Any) -> None:
    box, stage = page.locator("#notice").bounding_box(), page.locator("#stage").bounding_box()
    assert stage["x"] < box["x"] and box["x"] + box["width"] < stage["x"] + stage["width"]
    assert page.evaluate("notice.scrollHeight <= notice.clientHeight")
    page.click("#dismiss")
    assert page.inner_text("#notice") == "" and not page.locator("#dismiss").is_visible()


def test_colours_of_states_and_of_where_the_time_went_are_explained(page: Any) -> None:
    seek(page, 12.0)
    page.click("#tab_line")
    states, times = page.locator("#panel_line .key").all()
    said = [entry.inner_text() for entry in states.locator(".entry").all()]
    assert said == ["Suspended, starved", "Suspended, blocked", "Execute", "Held"]
    assert " ".join(times.inner_text().split()) == "running starved"


def test_bars_say_what_machines_do_now_and_for_what_they_wait(page: Any) -> None:
    page.click("#tab_line")
    seek(page, 22.0)
    label = page.get_attribute("#panel_line .bars", "aria-label")
    assert "capper Held" in label and "filler Suspended, blocked" in label
    x, y = (round(part) for part in to_pixels(page, 0.06, 0.0))
    orange = np.array([0xE6, 0x9F, 0x00])  # blocked: of the bar's end, and of the filler on the plan
    assert (np.abs(canvas(page)[y - 8 : y + 9, x - 12 : x + 1] - orange) < 30).all(axis=2).any()
    bar = canvas(page, "#panel_line .bars")[38 + 19 + 7]  # of the second machine, at half its height
    assert (np.abs(bar[round(len(bar) * 21.0 / 24.0)] - orange) < 30).all()


def test_the_plan_stays_where_it_is_unless_the_place_is_out_of_sight(page: Any) -> None:
    def camera() -> list[float]:
        return [float(part) for part in page.get_attribute("#plan", "data-camera").split()][:3]

    seek(page, 12.0)
    before = camera()
    page.click("#tab_alarms")
    page.locator("#panel_alarms .alarm", has_text="queue_stands").click()
    page.click("#tab_device")
    page.select_option("#panel_device select", "machines/capper")
    settled(page)
    assert camera() == before
    press(page, *"+" * 8)
    page.select_option("#panel_device select", "photo_eyes/exit")
    settled(page)
    assert camera()[:2] == pytest.approx([4.45, 1.2], abs=0.01)


def test_hostile_names_are_shown_as_text_under_a_policy(page: Any) -> None:
    page.click("#tab_alarms")
    assert "<img src=x onerror=alert(2)>" in page.inner_text("#panel_alarms")
    assert page.locator("#panels img").count() == 0
    policy = page.get_attribute("meta[http-equiv=Content-Security-Policy]", "content")
    assert "default-src 'none'" in policy and "unsafe" not in policy


def test_alarms_stand_as_they_did_and_a_click_jumps_to_their_beginning(page: Any) -> None:
    seek(page, 3.0)
    page.click("#tab_alarms")
    assert page.inner_text("#panel_alarms .rows") == "All alarms are normal."
    seek(page, 12.0)
    row = page.locator("#panel_alarms .alarm", has_text="capper_full")
    assert "unacknowledged" in row.inner_text() and "first out" in row.inner_text()
    row.click()
    settled(page)
    since = clock(page)
    assert 5.0 < since < 9.0
    press(page, ",")
    assert "capper_full" not in page.inner_text("#panel_alarms .rows")


def test_marks_of_what_happened_are_gone_through_by_keys(page: Any) -> None:
    page.click("#plan", position={"x": 20, "y": 20})
    press(page, "Home", "n")
    assert clock(page) == pytest.approx(5.0, abs=0.05)
    assert page.inner_text("#notice") == "fault photo_eyes/exit/stuck_on"


def test_events_are_filtered_and_a_click_jumps_there(page: Any) -> None:
    page.click("#tab_events")
    page.fill("#panel_events input[type=search]", "speed")
    settled(page)
    rows = page.locator("#panel_events .event")
    assert rows.count() == 1
    assert "command refused" in rows.first.inner_text()
    rows.first.click()
    settled(page)
    assert clock(page) == pytest.approx(8.0, abs=0.05)


def test_a_state_of_a_machine_is_one_event_with_what_is_known_of_why(page: Any) -> None:
    page.click("#tab_events")
    seek(page, 16.0)
    for kind in ("alarms", "faults", "commands"):
        page.uncheck(f"#panel_events input[value={kind}]")
    settled(page)
    said = [" ".join(row.split()) for row in page.locator("#panel_events .event").all_inner_texts()]
    assert "16.02 s machine state machines/capper Held, failure jam" in said
    assert any(row.endswith("machine state machines/filler Suspended, blocked") for row in said)
    assert not any("category" in row for row in said)
    page.fill("#panel_events input[type=search]", "filler/category")
    settled(page)
    assert page.locator("#panel_events .event").count() > 0, "who looks for them finds them"


def test_a_click_on_an_event_shows_what_it_changed(page: Any) -> None:
    """The capper fails at 16.02 s, between two frames."""
    page.click("#tab_events")
    seek(page, 16.0)
    page.locator("#panel_events .event", has_text="Held, failure jam").click()
    settled(page)
    assert clock(page) == pytest.approx(16.04, abs=1e-6)
    page.click("#tab_line")
    assert "capper Held" in page.get_attribute("#panel_line .bars", "aria-label")
    page.click("#tab_alarms")
    assert "unacknowledged · since 16.02 s" in page.inner_text("#panel_alarms .alarm:has-text('machines/capper/fault')")


def test_a_second_failure_of_one_kind_states_its_reason(browser: Any, tmp_path: Path) -> None:
    line = tmp_path / "line.yaml"
    line.write_text(LINE.read_text().replace("times: [12.0, 1000.0]", "times: [1.0, 1.0]").replace("[8.0]", "[1.0]"))
    record(tmp_path / "bag", 12.0, line=line)
    html = write_page(tmp_path / "bag", tmp_path / "page.html", last=1.0)
    with opened_page(browser, html) as page:
        page.click("#tab_events")
        press(page, "End")
        jams = page.locator("#panel_events .event", has_text="capper Held")
        assert jams.count() >= 2
        assert all("failure jam" in text for text in jams.all_inner_texts())
        jams.first.click()
        assert "before the shown part" in page.inner_text("#notice") and clock(page) == pytest.approx(11.0)
    html = write_page(tmp_path / "bag", tmp_path / "page.html")
    with opened_page(browser, html) as page:
        for state, note in (("Held", ""), ("Execute", "of the last stop")):
            page.click("#tab_events")
            page.locator("#panel_events .event", has_text=f"capper {state}").last.click()
            settled(page)
            page.click("#tab_device")
            reason = page.locator("#panel_device tr", has_text="stop_reason")
            assert " ".join(reason.inner_text().split()) == f"stop_reason {note} failure jam".replace("  ", " ")


@pytest.mark.parametrize(
    ("command", "value", "reason"), [("run", 0.0, "command run"), ("cntrl_cmd", 3.0, "command Stop")]
)
def test_a_stop_by_command_during_a_failure_states_the_command(
    browser: Any, tmp_path: Path, command: str, value: float, reason: str
) -> None:
    line = tmp_path / "line.yaml"
    line.write_text(LINE.read_text().replace("times: [12.0, 1000.0]", "times: [1.0, 1000.0]"))
    record(tmp_path / "bag", 7.0, line=line, commands=[(650, f"machines/capper/{command}", value)])
    with opened_page(browser, write_page(tmp_path / "bag", tmp_path / "page.html")) as page:
        page.click("#tab_events")
        press(page, "End")
        states = [
            text
            for text in page.locator("#panel_events .event").all_inner_texts()
            if "machine state machines/capper " in " ".join(text.split())
        ]
        assert "capper Held, failure jam" in states[-2]
        assert f"capper Stopped, {reason}" in states[-1]


def test_a_faceplate_shows_the_tags_of_the_device_that_is_clicked(page: Any) -> None:
    seek(page, 12.0)
    x, y = to_pixels(page, 1.5, 0.06)
    page.click("#plan", position={"x": x, "y": y - 8})  # beside the bottles
    settled(page)
    assert page.locator("#panel_device select").input_value() == "photo_eyes/queue"
    assert page.locator("#panel_device tr", has_text="blocked").locator("td").inner_text() in ("on", "off")
    page.select_option("#panel_device select", "belts/line")
    settled(page)
    row = page.locator("#panel_device tr", has_text="cmd_speed")
    assert row.locator("td").inner_text() == "0.3 m/s"
    assert "by test since 10.01 s" in row.inner_text()
    assert not page.locator("#panel_device .kind .badge").is_visible()
    page.select_option("#panel_device select", "zones/before_capper")
    settled(page)
    assert page.inner_text("#panel_device .kind .badge") == "▲ 1 alarm"
    assert "capper_full" in page.inner_text("#panel_device .rows")


def test_an_injected_fault_is_on_the_banner_in_every_panel(page: Any) -> None:
    seek(page, 4.0)
    assert not page.locator("#banner").is_visible()
    seek(page, 12.0)
    for panel in ("line", "alarms", "events", "device", "bottle"):
        page.click(f"#tab_{panel}")
        assert missing(page.inner_text("#banner"), "fault photo_eyes/exit/stuck_on = on") == [], panel
    page.locator("#banner button").click()
    assert page.input_value("#panel_device select") == "photo_eyes/exit"


def test_an_eye_is_lit_while_it_is_blocked(page: Any) -> None:
    for time, lit in ((2.0, False), (12.0, True)):
        seek(page, time)
        x, y = (round(part) for part in to_pixels(page, 4.38, 1.2))
        colour = canvas(page)[y, x - 2]
        assert (tuple(colour) == (0xD1, 0x33, 0x0D)) == lit


def test_a_gate_is_drawn_where_its_signal_has_it(page: Any) -> None:
    page.uncheck("#names")
    mover = np.array([0xA3, 0x44, 0x7F])
    for time, y in ((5.0, -0.1), (8.0, 0.0)):
        seek(page, time)
        px, py = (round(part) for part in to_pixels(page, 3.2, y))
        patch = canvas(page)[py - 2 : py + 3, px - 3 : px + 4]
        assert (np.abs(patch - mover) < 40).all(axis=2).any()


def test_a_bottle_is_chosen_followed_and_let_go(page: Any, bag: Path) -> None:
    seek(page, 12.0)
    time = float(page.get_attribute("#plan", "data-frame"))
    with open_bag(bag) as opened:
        bottles = next(frame.data for frame in opened.bottles() if abs(frame.time - time) < 1e-6)
    index = int(np.argmax((bottles.x > 2.7) & (bottles.x < 3.5)))
    x, y = to_pixels(page, bottles.x[index], bottles.y[index])
    page.click("#plan", position={"x": x, "y": y})
    settled(page)
    assert f"id\n{bottles.id[index]}\n" in page.inner_text("#panel_bottle")
    press(page, "f", "+", "+", ".")
    at = [float(part) for part in page.get_attribute("#plan", "data-camera").split()]
    assert at[0] == pytest.approx(bottles.x[index] + 0.5 * 0.04, abs=0.02)
    press(page, "Escape")
    assert "Click a bottle" in page.inner_text("#panel_bottle")


def test_bottles_are_chosen_by_keys_one_after_the_other(page: Any) -> None:
    seek(page, 12.0)
    press(page, "b")
    first = int(page.inner_text("#panel_bottle").split("id\n")[1].split("\n")[0])
    press(page, "b")
    assert int(page.inner_text("#panel_bottle").split("id\n")[1].split("\n")[0]) > first


def test_bottles_are_coloured_as_chosen_by_a_key(page: Any) -> None:
    page.click("#plan", position={"x": 20, "y": 20})
    press(page, "c")
    assert page.input_value("#colour") == "speed"
    assert "m/s" in page.inner_text("#legend")
    assert "contacts 0" in page.inner_text("#legend") and " N" in page.inner_text("#legend")
    page.uncheck("#forces")
    settled(page)
    assert "contacts" not in page.inner_text("#legend")


def test_it_is_zoomed_by_buttons_too(page: Any) -> None:
    scales = []
    for button in ("#fit", "#closer", "#farther"):
        page.click(button)
        settled(page)
        scales.append(float(page.get_attribute("#plan", "data-camera").split()[2]))
    assert scales == pytest.approx([scales[0], 1.5 * scales[0], scales[0]])


def test_rails_are_coloured_by_what_they_have_borne(page: Any) -> None:
    page.uncheck("#names")
    page.uncheck("#forces")
    press(page, "End")
    places = [tuple(map(round, to_pixels(page, 2.0, y))) for y in (0.036, -0.036)]  # of the rail that the queue is at
    hot = []
    for what in ("", "pressure"):
        page.select_option("#wear", what)
        settled(page)
        red, _, blue = np.moveaxis(canvas(page), 2, 0)
        hot.append(any(red[y, x] > blue[y, x] + 60 for x, y in places))
    assert hot == [False, True]
    assert "N/m" in page.inner_text("#legend")


def test_signals_are_put_on_the_trends_and_taken_off(page: Any) -> None:
    page.fill("#trendbar input", "zones/before_capper/bottles")
    press(page, "Enter")
    chip = page.locator(".chip", has_text="zones/before_capper/bottles")
    assert chip.count() == 1
    seek(page, 12.0)
    shown = page.locator(".chip", has_text="belts/line/speed").inner_text()
    assert " ".join(shown.split()) == "belts/line/speed 0.3 m/s ✕", "what it is then"
    assert page.locator("#trends canvas").count() == 1
    chip.click()
    assert chip.count() == 0


def test_an_unknown_signal_is_refused_beside_the_field_with_the_nearest_names(page: Any) -> None:
    before = page.locator(".chip").count()
    page.fill("#trendbar input", "zones/before_caper/botles")
    press(page, "Enter")
    assert missing(page.inner_text("#trendbar .refusal"), "zones/before_caper/botles") == []
    assert page.locator(".chip").count() == before and page.input_value("#trendbar input") != ""
    page.locator("#trendbar .refusal button", has_text="zones/before_capper/bottles").click()
    assert page.locator(".chip", has_text="zones/before_capper/bottles").count() == 1
    assert page.inner_text("#trendbar .refusal") == "" and page.input_value("#trendbar input") == ""


def test_commands_and_alarms_are_put_on_the_trends(page: Any) -> None:
    for name in ("gates/hold/open", "alarms/queue_stands"):
        page.fill("#trendbar input", name)
        press(page, "Enter")
    for time, values in ((5.5, ["on", "off"]), (8.0, ["off", "off"]), (20.0, ["on", "on"])):
        seek(page, time)
        shown = [page.locator(".chip", has_text=name).inner_text().split()[1] for name in ("hold/open", "queue_stands")]
        assert shown == values, time


def test_a_bottle_that_left_says_where_and_when(page: Any, bag: Path) -> None:
    with open_bag(bag) as opened:
        frames = (frame.data for frame in opened.read("events"))
        at, device, bottle = next(
            (int(data.at[place]) * 0.01, data.name[place], int(data.bottle[place]))
            for data in frames
            for place, kind in enumerate(data.kind)
            if kind == "bottle_removed"
        )
    page.click("#tab_events")
    page.check("#panel_events input[value=bottles]")
    page.fill("#panel_events input[type=search]", f"removed {device}")
    settled(page)
    page.locator("#panel_events .event", has_text=f"bottle {bottle} ").or_(
        page.locator("#panel_events .event", has_text=f"bottle {bottle}\n")
    ).first.click()
    page.click("#tab_bottle")
    seek(page, at + 3.0)
    assert missing(page.inner_text("#panel_bottle"), f"left by {device} at {at:.2f} s") == []
    page.locator("#panel_bottle button", has_text=device).click()
    settled(page)
    assert clock(page) == pytest.approx(at, abs=0.05)


def test_switches_have_a_lane_each_on_the_trends(page: Any) -> None:
    page.uncheck("#names")
    seek(page, 12.0)
    pixels = canvas(page, "#trends canvas")
    lanes = []
    for colour in ((0x00, 0x9E, 0x73), (0xCC, 0x79, 0xA7)):  # of the two eyes, the third and the fourth signal
        rows = np.nonzero((np.abs(pixels - np.array(colour)) < 12).all(axis=2).sum(axis=1) > 20)[0]
        lanes.append((rows.min(), rows.max()))
    assert lanes[0][0] < lanes[0][1] < lanes[1][0] < lanes[1][1]


@pytest.mark.parametrize("size", [(1280, 720), (820, 1180)], ids=["laptop", "tablet"])
def test_everything_fits_and_has_a_name_for_those_who_hear_it(page: Any, size: tuple[int, int]) -> None:
    page.set_viewport_size({"width": size[0], "height": size[1]})
    settled(page)
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
    assert page.locator("#scrubber").bounding_box()["width"] > 0.5 * size[0]


def test_long_names_stay_where_they_belong(browser: Any, tmp_path: Path) -> None:
    name = "capper_" + "that_has_a_long_name_" * 3
    line = tmp_path / "line.yaml"
    line.write_text(LINE.read_text().replace("  capper:", f"  {name}:").replace("small_packaging", name))
    html = write_page(record(tmp_path / "bag", 4.0, line=line), tmp_path / "page.html")
    with opened_page(browser, html) as page:
        press(page, "End")
        wide = (
            "Array.from(document.querySelectorAll('.tile, header')).filter((one) => one.scrollWidth > one.clientWidth)"
        )
        assert page.locator(".tile h3", has_text=name).count() == 1 and page.evaluate(f"{wide}.length") == 0


def test_dark_is_dark(page: Any) -> None:
    bright = canvas(page)[5, 5].sum()
    page.click("#theme")
    settled(page)
    assert canvas(page)[5, 5].sum() < 0.3 * bright
