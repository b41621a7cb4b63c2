# SPDX-License-Identifier: Apache-2.0
"""The main states of the page that docs/ shows: how each is reached by clicks and keys."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class State:
    """One picture of docs/images."""

    reach: Callable[[Any], None]
    size: tuple[int, int] = (1280, 720)
    of: str = "line"
    """The page: of the line; `failed`: with a condition that failed; `pair`: of the line and, beside it, the other."""


def at(page: Any, time: int) -> None:
    """Go to a time in s by keys."""
    page.focus("#scrubber")
    page.keyboard.press("Home")
    for _ in range(time):
        page.keyboard.press("ArrowRight")


def line(page: Any) -> None:
    """The capper stands."""
    at(page, 16)


def bottle(page: Any) -> None:
    """The bottle that waits for it, dark."""
    at(page, 16)
    page.click("#theme")
    x, y, scale, width, height = map(float, page.get_attribute("#plan", "data-camera").split())
    page.click("#plan", position={"x": width / 2 + (1.96 - x) * scale, "y": height / 2 + y * scale})
    page.keyboard.press("f")
    for _ in range(5):
        page.keyboard.press("+")
    page.select_option("#colour", "force")


def failed(page: Any) -> None:
    """A machine at the time of the failure, on a tablet."""
    page.click("#tab_device")
    page.select_option("#panel_device select", "machines/capper")
    page.focus("#scrubber")
    page.keyboard.press("n")


def two(page: Any) -> None:
    """Show a time after two recordings have diverged."""
    at(page, 12)
    page.select_option("#colour", "apart")


STATES = {
    "view_line": State(line),
    "view_bottle": State(bottle),
    "view_failed": State(failed, (820, 1180), "failed"),
    "view_two": State(two, of="pair"),
}
