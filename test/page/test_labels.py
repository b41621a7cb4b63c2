# SPDX-License-Identifier: Apache-2.0
"""Names on the plan by geometry: on every shipped scene, in four sizes of the window, none covers another."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Any

import pytest
from page.conftest import opened_page
from page.line import LINE, record
from page.pixels import settled, to_pixels
from study_page import load_study

from conveyor_sim.page.one_file import write_page
from conveyor_sim.run.runner import run_scene
from conveyor_sim.scene import load_scene, parse_scene
from conveyor_sim.support.resources import scene_path

ROOT = Path(__file__).resolve().parents[2]
SCENES = [
    *(path.stem for path in sorted((ROOT / "config").glob("*.yaml"))),
    *(f"examples/{path.name}" for path in sorted((ROOT / "examples").glob("*.yaml"))),
]
SIZES = [(1280, 720), (1920, 1080), (820, 1180), (390, 844)]
SECONDS = 3.0
"""Greatest length of a recording, s."""
NOTE_TEXTS = """
const drawn = CanvasRenderingContext2D.prototype.fillText, cleared = CanvasRenderingContext2D.prototype.fillRect;
window.texts = [];
CanvasRenderingContext2D.prototype.fillText = function (text, x, y, ...more) {
  if (this.canvas.id === "plan") {
    const { width, actualBoundingBoxAscent: up, actualBoundingBoxDescent: down } = this.measureText(text);
    window.texts.push([text, x - width / 2, y - up, x + width / 2, y + down]);
  }
  return drawn.call(this, text, x, y, ...more);
};
CanvasRenderingContext2D.prototype.fillRect = function (x, y, width, height) {
  if (this.canvas.id === "plan" && width === this.canvas.clientWidth) window.texts = [];
  return cleared.call(this, x, y, width, height);
};
"""
"""Records the texts of the last frame of the plan with their boxes in px. Everything is drawn as usual."""


@pytest.fixture(scope="module", params=SCENES)
def shipped(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, bool]:
    """The page of a shipped scene; True if the scene has belts, which have names."""
    name = request.param
    path = ROOT / name if "/" in name else scene_path(name)
    folder = tmp_path_factory.mktemp("labels")
    scene = load_scene(path, {"duration": min(SECONDS, load_scene(path).duration)})
    run_scene(scene, folder / "bag")
    return write_page(folder / "bag", folder / "page.html"), bool(scene.belts)


def texts(page: Any) -> list[tuple[str, float, float, float, float]]:
    """Return the names on the plan with left, top, right and bottom edge, px."""
    settled(page)
    return [tuple(row) for row in page.evaluate("window.texts")]


def check(page: Any) -> list[str]:
    """Check that names overlap neither each other nor what lies over the plan, and are inside. Return them."""
    found = texts(page)
    width, height = (page.evaluate(f"document.getElementById('plan').client{side}") for side in ("Width", "Height"))
    over = page.evaluate(
        """() => {
            const at = document.getElementById("plan").getBoundingClientRect();
            return Array.from(document.querySelectorAll("#legend, #zoom, #map:not([hidden])"), (one) => {
                const box = one.getBoundingClientRect();
                return [one.id, box.left - at.left, box.top - at.top, box.right - at.left, box.bottom - at.top];
            });
        }"""
    )
    for text, left, top, right, bottom in found:
        assert left >= 0 and top >= 0 and right <= width and bottom <= height, text
    for one, other in [*combinations(found, 2), *((one, other) for one in found for other in over)]:
        apart = one[3] <= other[1] or other[3] <= one[1] or one[4] <= other[2] or other[4] <= one[2]
        assert apart, f"{one[0]} and {other[0]}"
    return [text for text, *_ in found]


@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
def test_names_do_not_overlap(browser: Any, shipped: tuple[Path, bool], size: tuple[int, int]) -> None:
    html, has_belts = shipped
    with opened_page(browser, html, size, NOTE_TEXTS) as page:
        names = check(page)
        assert names or not has_belts
        for key in ("+", "+", "d"):
            page.keyboard.press(key)
        check(page)


@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
def test_names_stand_apart_while_the_line_works(browser: Any, html: Path, size: tuple[int, int]) -> None:
    with opened_page(browser, html, size, NOTE_TEXTS) as page:
        names = check(page)
        assert any(name.startswith("capper") for name in names)
        page.keyboard.press("Home")
        for _ in range(8):
            page.keyboard.press("Shift+ArrowRight")
            check(page)


def test_devices_close_together_have_names_with_leader_lines(browser: Any, tmp_path: Path) -> None:
    line = tmp_path / "line.yaml"
    eyes = "\n".join(f"  eye_number_{i}: {{from: [{1 + i / 16}, -0.06], to: [{1 + i / 16}, 0.06]}}" for i in range(8))
    line.write_text(LINE.read_text().replace("photo_eyes:\n", f"photo_eyes:\n{eyes}\n"))
    html = write_page(record(tmp_path / "bag", 2.0, line=line), tmp_path / "page.html")
    with opened_page(browser, html, script=NOTE_TEXTS) as page:
        names = check(page)
    assert sum(name.startswith("eye_number_") for name in names) >= 4, "beside the belt there is room for two"


INFEEDS = """
name: three_infeeds
duration: 0.1
accuracy: draft
bottle_types: {bottle: {radius: 33 mm, mass: 350 g, material: glass}}
contacts: [{between: [glass, glass], stiffness: 20 kN/m}]
base: [{between: [glass, chain], friction: 0.15}]
conveyors: {table: {start: [0, 0], heading: 0 deg, path: [{straight: 2}], width: 400 mm, material: chain, speed: 0.2}}
infeeds:
  right: {along: table, at: 0.1, offset: -0.15, bottle: bottle, rate: 1 /s}
  middle: {along: table, at: 0.1, bottle: bottle, rate: 1 /s}
  left: {along: table, at: 0.1, offset: 0.15, bottle: bottle, rate: 1 /s}
"""


def test_infeeds_beside_each_other_have_their_names_at_their_arrows(browser: Any, tmp_path: Path) -> None:
    run_scene(parse_scene(INFEEDS), tmp_path / "bag")
    html = write_page(tmp_path / "bag", tmp_path / "page.html")
    with opened_page(browser, html, script=NOTE_TEXTS) as page:
        boxes = {name: box for name, *box in texts(page)}
        for name, y in (("right", -0.15), ("middle", 0.0), ("left", 0.15)):
            _, top, right, bottom = boxes[name]
            arrow_x, arrow_y = to_pixels(page, 0.1, y)
            assert right < arrow_x and top < arrow_y < bottom, name


@pytest.mark.parametrize(
    ("part", "name", "place"),
    [("stoppers", "grip", (1.0, 0.0)), ("dividers", "left", (0.7, 0.05)), ("dividers", "right", (0.7, -0.05))],
)
def test_a_mover_is_named_once_beside_its_rails(
    browser: Any, tmp_path: Path, part: str, name: str, place: tuple[float, float]
) -> None:
    """A clamp has two jaws. A long guide that is adjusted across a lane has its name beside the lane, 0.1 m away."""
    text = load_study("part_pictures").scene_text(ROOT / "docs" / "parts" / f"{part}.md")
    run_scene(parse_scene(text, overrides={"duration": 0.2}), tmp_path / "bag")
    html = write_page(tmp_path / "bag", tmp_path / "page.html")
    with opened_page(browser, html, script=NOTE_TEXTS) as page:
        ((_, left, top, right, bottom),) = [one for one in texts(page) if one[0] == name]
        x, y = to_pixels(page, *place)
        scale = float(page.get_attribute("#plan", "data-camera").split()[2])
    assert left - 5 <= x <= right + 5
    assert 0.0 < max(top - y, y - bottom) < 0.1 * scale
