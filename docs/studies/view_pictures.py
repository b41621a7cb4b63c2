# SPDX-License-Identifier: Apache-2.0
"""The pictures of the page in docs/ and README: python docs/studies/view_pictures.py [NAME ...].

Each named state of the page is shown in four sizes of the window and two themes (docs/images/page). Needs playwright,
Pillow and Chromium, as the tests do. Without names all are made anew, in about four minutes.
"""

from __future__ import annotations

import io
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from part_pictures import PARTS, save_image, scene_text
from PIL import Image, ImageDraw
from playwright.sync_api import sync_playwright

from conveyor_sim.page.one_file import write_page
from conveyor_sim.protocols.server.users import keep_user, new_user
from conveyor_sim.protocols.tags.scene_messages import SceneTask
from conveyor_sim.protocols.tags.scene_provider import SceneTagProvider
from conveyor_sim.run.runner import run_scene
from conveyor_sim.scene import load_scene, parse_scene
from conveyor_sim.support.resources import scene_path

ROOT = Path(__file__).resolve().parents[2]
IMAGES = ROOT / "docs" / "images"
MOMENT = 80
"""ms that a step of a moving line stands: two frames of the page at 25 Hz."""
QUALITY = 30
"""Quality of moving pictures."""
COMMON, RARE = 24, 48
"""Numbers of colours of a still picture: the most common ones as they are, and others. Its texts stay sharp."""
FAILING = """
from test_jam import check_wedge, too_late, wedged

def test_a_wedged_pair_is_alarmed_within_5_s(line):
    check_wedge(wedged(line, "abreast"), too_late())
"""
"""A test with a controller that raises its alarm too late."""

sys.path.insert(0, str(ROOT / "test"))
from page.conftest import BROWSERS  # noqa: E402
from page.line import LINE, record  # noqa: E402
from page.live_line import PASSWORD, Live, clock, put_into_mode, set_speed, signed_in, soon  # noqa: E402
from page.states import FAILURE, STATES, State, at, views  # noqa: E402


class Studio:
    """A browser, and recordings that are made when a picture needs them."""

    def __init__(self, browser: Any, folder: Path) -> None:
        self._browser, self.folder = browser, folder

    @contextmanager
    def page(self, html: Path, size: tuple[int, int]) -> Iterator[Any]:
        """Yield a page that is completely loaded."""
        with self.opened(size) as page:
            page.goto(html.as_uri())
            page.wait_for_selector("body[data-told]", state="attached")
            yield page

    @contextmanager
    def opened(self, size: tuple[int, int]) -> Iterator[Any]:
        """Yield an empty page."""
        page = self._browser.new_page(viewport={"width": size[0], "height": size[1]})
        yield page
        page.close()

    def bag(self, name: str) -> Path:
        """Return the bag of a test line (`line`, `other`), or of a shipped scene."""
        bag = self.folder / "runs" / name
        if not bag.exists():
            bag.parent.mkdir(exist_ok=True)
            if name in ("closes_at_6_s", "stays_open"):
                record(bag, closes=name == "closes_at_6_s")
            else:
                run_scene(load_scene(scene_path(name)), bag)
        return bag

    def state(self, state: State) -> Path:
        """Return the page of a state of the tests."""
        html = self.folder / f"{state.of}.html"
        if state.of == "paper_plant":
            return self.shipped(state.of)
        failures = [FAILURE] if state.of == "failed" else []
        trends = [name for failure in failures for name in failure.values]
        other = self.bag("stays_open") if state.of == "pair" else None
        return write_page(self.bag("closes_at_6_s"), html, failures=failures, trends=trends, other=other)

    def shipped(self, scene: str) -> Path:
        """Return the page of a shipped scene."""
        return write_page(self.bag(scene), self.folder / f"{scene}.html")

    def failure(self) -> Path:
        """Return the page that pytest writes for a failed test."""
        file = self.folder / "test_late.py"
        file.write_text(FAILING)
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--line-failures", "left", file.name]
        paths = os.pathsep.join([str(ROOT / "examples" / "scenarios"), str(ROOT)])
        subprocess.run(command, cwd=self.folder, env={**os.environ, "PYTHONPATH": paths}, check=False)
        return next(self.folder.glob("left/*/line.html"))


def still(name: str) -> Callable[[Studio], None]:
    """Return a function that takes a picture of a state of the tests."""

    def make(studio: Studio) -> None:
        state = STATES[name]
        with studio.page(studio.state(state), (1280, 720)) as page:
            if state.of == "pair":
                page.wait_for_selector("body[data-compared]")
            state.reach(page)
            keep(page, name)

    return make


def keep(page: Any, name: str) -> None:
    """Save the pictures of a state in every size and theme."""
    folder = IMAGES / "page"
    folder.mkdir(exist_ok=True)
    for view in views(page):
        few_colours(grab(page)).save(folder / f"{name}-{view}.webp", lossless=True, method=6)


def few_colours(picture: Image.Image) -> Image.Image:
    """Return a picture with COMMON + RARE colours."""
    counted = sorted(picture.getcolors(picture.width * picture.height), reverse=True)
    common = [part for _, colour in counted[:COMMON] for part in colour]
    rare = picture.quantize(RARE, Image.Quantize.MAXCOVERAGE).getpalette()
    palette = Image.new("P", (1, 1))
    palette.putpalette(common + rare)
    return picture.quantize(palette=palette, dither=Image.Dither.NONE).convert("RGB")


def grab(page: Any, found: str = "body") -> Image.Image:
    """Take a picture of the present view."""
    page.wait_for_timeout(60)
    return Image.open(io.BytesIO(page.locator(found).screenshot())).convert("RGB")


def save(name: str, pictures: list[Image.Image], each: list[int] | int, **options: Any) -> None:
    """Save an endless animation. each: ms per picture."""
    pictures[0].save(
        IMAGES / f"{name}.webp", save_all=True, append_images=pictures[1:], duration=each, loop=0, method=6, **options
    )


def moving(
    name: str, scene: str, size: tuple[int, int], start: int, count: int, step: int, moment: int = MOMENT
) -> Callable[[Studio], None]:
    """Return a function that records a shipped scene from a time (s) on, every `step` frames: the plan, with forces."""

    def make(studio: Studio) -> None:
        with studio.page(studio.shipped(scene), size) as page:
            page.click("#toggle_trends")
            page.uncheck("#names")
            page.select_option("#colour", "force")
            at(page, start)
            pictures = []
            for _ in range(count):
                pictures.append(grab(page, "#plan"))
                for _ in range(step):
                    page.keyboard.press(".")
        save(name, pictures, moment, quality=QUALITY)

    return make


def scrubbed(studio: Studio) -> None:
    """Record the page of a failed test: by the scrubber to the failure, back, and frame by frame."""
    pictures, each = [], []
    with studio.page(studio.failure(), (1024, 600)) as page:
        page.select_option("#colour", "force")
        box = page.locator("#scrubber").bounding_box()
        y = box["y"] + box["height"] / 2

        def show(share: float, time: int) -> None:
            """Draw the scrubber to a share of the recording, and take a picture that stands for a time in ms."""
            x = box["x"] + 8 + share * (box["width"] - 16)
            page.mouse.move(x, y)
            pictures.append(few_colours(with_pointer(grab(page), x, y)))
            each.append(time)

        page.mouse.move(box["x"] + 8, y)
        page.mouse.down()
        show(0.0, 1200)
        for step in range(1, 41):
            show(step / 40, 80)
        each[-1] = 1500
        for step in range(1, 9):
            show(1.0 - 0.05 * step, 80)
        for step in range(1, 9):
            show(0.6 + 0.05 * step, 160)
        each[-1] = 2500
        page.mouse.up()
    save("view_scrubbed", pictures, each, lossless=True)


def live(studio: Studio) -> None:
    """Record a running line whose operator sets a belt to manual mode and slows it down."""
    keep_user(studio.folder / "users", "jo", new_user("operator", PASSWORD))
    scene = load_scene(LINE, {"duration": 3600.0})
    with (
        SceneTagProvider(SceneTask(scene, None, 0, 1.0, 1), lambda text: None) as source,
        studio.opened((1280, 720)) as page,
    ):
        source.wait_for_line()
        served = Live(studio.folder, source)
        served.serve()
        page.goto(served.url)
        page.wait_for_selector("body[data-told]", state="attached")
        signed_in(page, "jo")
        soon(page, lambda: clock(page) > 15.0, "the capper has jammed")
        put_into_mode(page, "3")
        set_speed(page, "0.2")
        soon(page, lambda: clock(page) > 18.0, "the belt is slow")
        keep(page, "live")
        served.end()


def panel(studio: Studio) -> None:
    """Take a picture of the scene of docs/parts/panel.md after an operator has pressed the emergency stop."""
    keep_user(studio.folder / "users", "jo", new_user("operator", PASSWORD))
    scene = parse_scene(scene_text(PARTS / "panel.md"))
    with (
        SceneTagProvider(SceneTask(scene, None, 0, 1.0, 1), lambda text: None) as source,
        studio.opened((1280, 900)) as page,
    ):
        source.wait_for_line()
        served = Live(studio.folder, source)
        served.serve()
        page.goto(served.url)
        page.wait_for_selector("body[data-told]", state="attached")
        signed_in(page, "jo")
        soon(page, lambda: clock(page) > 9.0, "bottles at the packer")
        page.click("[data-part=estop] .mushroom")
        soon(page, lambda: clock(page) > 11.0, "the belt stands")
        save_image(grab(page), IMAGES / "parts" / "panel.webp")
        served.end()


def with_pointer(picture: Image.Image, x: float, y: float) -> Image.Image:
    """With the pointer of a mouse, which is in no picture of a browser."""
    arrow = [(0, 0), (0, 17), (4, 13), (7, 20), (10, 19), (7, 12), (12, 12)]
    ImageDraw.Draw(picture).polygon([(x + dx, y + dy) for dx, dy in arrow], fill="black", outline="white")
    return picture


PICTURES: dict[str, Callable[[Studio], None]] = {
    **{name: still(name) for name in STATES},
    "view_plant": moving("view_plant", "paper_plant", (1050, 460), 14, 30, 3, 3 * MOMENT // 2),
    "view_table": moving("view_table", "accumulation_table", (1050, 500), 1, 18, 2, 2 * MOMENT),
    "view_scrubbed": scrubbed,
    "live": live,
    "panel": panel,
}


def main() -> None:
    """Make the pictures that are named, or all."""
    names = sys.argv[1:] or list(PICTURES)
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        executable = next(filter(None, map(shutil.which, BROWSERS)))
        browser = driver.chromium.launch(executable_path=executable, args=["--no-sandbox"])
        studio = Studio(browser, Path(folder))
        for name in names:
            PICTURES[name](studio)
        browser.close()


if __name__ == "__main__":
    main()
