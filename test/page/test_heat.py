# SPDX-License-Identifier: Apache-2.0
"""Heat maps of a recording and of a running line, against maps that are computed from the bag."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from page.conftest import opened_page
from page.live_line import Live, clock, soon
from page.pixels import canvas, settled, to_pixels

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.page.one_file import write_page

CELL = 0.1
"""Size of the map's cells, m."""


@pytest.fixture(scope="module")
def plain(bag: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_page(bag, tmp_path_factory.mktemp("heat") / "line.html")


def choose(page: Any, name: str, span: str = "last") -> str:
    """Show a heat map. Return its legend once it is complete."""
    page.select_option("#heat", name)
    page.select_option("#span", span)
    for _ in range(200):
        settled(page)
        legend = page.inner_text("#legend .heat")
        if "% read" not in legend and "≥ 0 " not in legend:
            return " ".join(legend.split())
        page.wait_for_timeout(50)
    raise AssertionError("the map is not complete")


def top(legend: str) -> tuple[float, str]:
    """Return the value of the strongest colour and its unit."""
    value, unit, *_ = legend.split("≥ ")[1].split()
    return float(value), unit


def lightness(page: Any, x: float, y: float) -> float:
    """Return the mean of the colours at a point of the line, 0 to 255."""
    px, py = (round(part) for part in to_pixels(page, x, y))
    return float(canvas(page)[py - 1 : py + 2, px - 1 : px + 2].mean())


def cells(bag: Path) -> tuple[Counter[tuple[int, int]], dict[tuple[int, int], float], int]:
    """Return frames of bottles and greatest force by cell of the recorded line, and the number of frames."""
    count: Counter[tuple[int, int]] = Counter()
    force: dict[tuple[int, int], float] = defaultdict(float)
    frames = 0
    with open_bag(bag) as opened:
        for frame in opened.bottles():
            frames += 1
            places = np.floor(np.stack([frame.data.x, frame.data.y + 0.06], axis=1) / CELL).astype(int)
            for place, peak in zip(places.tolist(), frame.data.peak_force.tolist(), strict=True):
                count[tuple(place)] += 1
                force[tuple(place)] = max(force[tuple(place)], peak)
    return count, force, frames


def quantile(values: list[float]) -> float:
    return sorted(values)[int(0.98 * (len(values) - 1))]


def test_density_has_the_unit_and_the_scale_of_the_recorded_bottles(browser: Any, plain: Path, bag: Path) -> None:
    count, _, frames = cells(bag)
    with opened_page(browser, plain) as page:
        page.keyboard.press("End")
        value, unit = top(choose(page, "density", "whole"))
        assert unit == "bottles/m²"
        assert value == pytest.approx(quantile([n / frames / CELL**2 for n in count.values()]), rel=0.25)
        page.uncheck("#names")
        page.uncheck("#forces")
        settled(page)
        assert lightness(page, 1.7, 0.02) < lightness(page, 4.0 + 0.45 * 0.7, 0.45 - 0.45 * 0.7), "queue and bend"


def test_force_and_dwell_time_have_units(browser: Any, plain: Path, bag: Path) -> None:
    _, force, _ = cells(bag)
    with opened_page(browser, plain) as page:
        page.keyboard.press("End")
        value, unit = top(choose(page, "force", "whole"))
        assert unit == "N" and value == pytest.approx(quantile(list(force.values())), rel=0.3)
        value, unit = top(choose(page, "dwell", "whole"))
        assert unit == "s" and 0.4 < value < 8.0, "0.2 s in free flow, longer before the capper"


def test_the_map_of_the_last_minute_follows_the_time(browser: Any, plain: Path) -> None:
    with opened_page(browser, plain) as page:
        page.keyboard.press("End")
        late, _ = top(choose(page, "dwell"))
        page.keyboard.press("Home")
        page.keyboard.press("Shift+ArrowRight")
        settled(page)
        early, _ = top(choose(page, "dwell"))
        assert early < late
        page.select_option("#heat", "")
        settled(page)
        assert page.locator("#legend .heat").count() == 0 and not page.locator("#span").is_visible()


def test_colours_of_heat_maps_fall_or_rise_in_lightness(browser: Any, plain: Path) -> None:
    """Lightness alone tells the values apart, for those who do not see all colours."""
    with opened_page(browser, plain) as page:
        for _ in range(2):
            choose(page, "density")
            style = page.evaluate("document.querySelector('#legend .heat .ramp').style.background")
            colours = [list(map(int, part.split(")")[0].split(","))) for part in style.split("rgb(")[1:]]
            light = [0.2126 * red + 0.7152 * green + 0.0722 * blue for red, green, blue in colours]
            assert len(light) >= 8 and light in (sorted(light), sorted(light, reverse=True))
            page.click("#theme")


def test_a_running_line_has_heat_maps(live: Live, open_page: Callable[[str], Any]) -> None:
    page = open_page(live.url)
    soon(page, lambda: clock(page) > 3.0, "bottles have moved")
    for name, unit in (("density", "bottles/m²"), ("force", "N"), ("dwell", "s")):
        page.select_option("#heat", name)
        soon(
            page,
            lambda unit=unit: top(" ".join(page.inner_text("#legend .heat").split()))[1] == unit,
            f"the legend is in {unit}",
        )
    page.select_option("#heat", "density")
    page.select_option("#span", "whole")
    soon(page, lambda: top(" ".join(page.inner_text("#legend .heat").split()))[0] > 0.0, "the map has a scale")
    soon(page, lambda: "received data" in page.inner_text("#legend .heat"), "the map is that of the received data")


@pytest.mark.parametrize("width", [1010, 1100, 1200, 1280])
def test_all_choices_fit_in_the_header(browser: Any, plain: Path, width: int) -> None:
    with opened_page(browser, plain, (width, 720)) as page:
        choose(page, "density")
        assert page.locator("#worn").is_visible()
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        box = page.locator("#help").bounding_box()
        assert box["x"] + box["width"] <= width
