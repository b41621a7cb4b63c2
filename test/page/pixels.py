# SPDX-License-Identifier: Apache-2.0
"""Pixels of a page's drawings."""

from __future__ import annotations

from base64 import b64decode
from collections.abc import Callable
from typing import Any

import numpy as np

from conveyor_sim.columns.bottles import BottleColumns

TYPE_COLOURS = ((0, 114, 178), (213, 94, 0))
"""Colours of the first two bottle types, in the colouring by type."""


def settled(page: Any) -> None:
    """Wait for what is drawn next, for what that sends for, and until that is drawn, however slow the machine is."""
    frames = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
    for _ in range(2):
        page.evaluate(frames)
        page.wait_for_selector('body:not([data-reading]), body[data-reading="0"]', state="attached", timeout=60_000)
    page.evaluate(frames)


def to_pixels(page: Any, x: float, y: float) -> tuple[float, float]:
    """Return the pixel of the canvas at a point of the line."""
    at_x, at_y, scale, width, height = map(float, page.get_attribute("#plan", "data-camera").split())
    return width / 2 + (x - at_x) * scale, height / 2 - (y - at_y) * scale


def canvas(page: Any, found: str = "#plan") -> np.ndarray:
    """The pixels (height, width, 3) of a canvas: the plan."""
    data = page.evaluate(
        """(found) => {
            const plan = document.querySelector(found), { width, height } = plan;
            const bytes = plan.getContext("2d").getImageData(0, 0, width, height).data;
            const pieces = [], most = 30000;
            for (let at = 0; at < bytes.length; at += most) {
                pieces.push(String.fromCharCode(...bytes.subarray(at, at + most)));
            }
            return [width, height, btoa(pieces.join(""))];
        }""",
        found,
    )
    pixels = np.frombuffer(b64decode(data[2]), dtype=np.uint8).astype(np.int64)
    return pixels.reshape(data[1], data[0], 4)[..., :3]


def disc(pixels: np.ndarray, colour: tuple[int, int, int], x: float, y: float, reach: float) -> np.ndarray:
    """Middle (x, y) of the box around pixels of a colour near a point."""
    rows, columns = np.nonzero((np.abs(pixels - np.array(colour)) < 30).all(axis=2))
    near = (np.abs(columns + 0.5 - x) < reach) & (np.abs(rows + 0.5 - y) < reach)
    assert near.any(), f"nothing of {colour} near {x:.1f}, {y:.1f}"
    rows, columns = rows[near], columns[near]
    return np.array([(columns.min() + columns.max() + 1) / 2, (rows.min() + rows.max() + 1) / 2])


def count_where_they_are(page: Any, bottles: BottleColumns, clear: Callable[[float], bool]) -> int:
    """See that bottles are drawn within a pixel of their places; how many. clear: x where no mark is over them."""
    pixels, scale = canvas(page), float(page.get_attribute("#plan", "data-camera").split()[2])
    radius = np.array([0.04, 0.035])[bottles.type] * scale
    inside = [index for index in range(len(bottles.id)) if clear(bottles.x[index])]
    for index in inside:
        x, y = to_pixels(page, bottles.x[index], bottles.y[index])
        found = disc(pixels, TYPE_COLOURS[bottles.type[index]], x, y, radius[index] + 1)
        assert np.abs(found - [x, y]).max() <= 1.0
    return len(inside)
