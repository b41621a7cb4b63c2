# SPDX-License-Identifier: Apache-2.0
"""The main states of the page that docs/ shows, how each is reached by clicks and keys, and its pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from page.pixels import settled

from conveyor_sim.page.one_file import FailedCondition, LastAction

SIZES = ((1280, 720), (1920, 1080), (820, 1180), (390, 844))
"""Sizes of the window, px: laptop, control room, tablet, phone."""
THEMES = ("light", "dark")


@dataclass(frozen=True)
class State:
    """One state of the page, in every size of the window and both themes in docs/images/page."""

    reach: Callable[[Any], None]
    of: str = "line"
    """The page: of the line; `failed`: with a condition that failed; `pair`: of the line and, beside it, the other; or
    the name of a shipped scene."""


def views(page: Any) -> Iterator[str]:
    """Show a page in every size and theme. Yield the name of each view."""
    for theme in THEMES:
        for width, height in SIZES:
            page.set_viewport_size({"width": width, "height": height})
            settled(page)
            page.wait_for_timeout(100)
            yield f"{width}x{height}-{theme}"
        page.click("#theme")


def at(page: Any, time: int) -> None:
    """Go to a time in s by keys."""
    page.focus("#scrubber")
    page.keyboard.press("Home")
    for _ in range(time):
        page.keyboard.press("ArrowRight")
    page.evaluate("document.activeElement.blur()")


def line(page: Any) -> None:
    """The capper stands."""
    at(page, 16)


def device(page: Any) -> None:
    """The capper is selected and zoomed to."""
    at(page, 16)
    page.click("#tab_device")
    page.select_option("#panel_device select", "machines/capper")
    page.click("#approach")


def bottle(page: Any) -> None:
    """The bottle that waits for it is followed."""
    at(page, 16)
    settled(page)
    x, y, scale, width, height = map(float, page.get_attribute("#plan", "data-camera").split())
    page.click("#plan", position={"x": width / 2 + (1.96 - x) * scale, "y": height / 2 + y * scale})
    page.keyboard.press("f")
    for _ in range(5):
        page.keyboard.press("+")
    page.select_option("#colour", "force")


def heat(page: Any) -> None:
    """The dwell time on an accumulation table."""
    page.uncheck("#forces")
    page.select_option("#heat", "dwell")
    page.select_option("#span", "whole")
    page.wait_for_selector("#legend .heat")


def failed(page: Any) -> None:
    """The time of the failure, with its condition."""
    page.click("#tab_failure")
    page.click(".failure dl button")
    page.evaluate("document.activeElement.blur()")


def two(page: Any) -> None:
    """Show a time after two recordings have diverged."""
    at(page, 12)
    page.select_option("#colour", "apart")


FAILURE = FailedCondition(
    13.0,
    "always: zones/before_capper/bottles ≤ 20",
    since=0.0,
    values={"zones/before_capper/bottles": 21.0},
    action=LastAction(10.0, "belts/line/cmd_speed = 0.3"),
)
"""A condition that the recorded line violates."""

STATES = {
    "line": State(line),
    "device": State(device),
    "bottle": State(bottle),
    "heat": State(heat, "paper_plant"),
    "failed": State(failed, "failed"),
    "two": State(two, "pair"),
}
