"""The pictures of the page in docs/ and README: python docs/studies/view_pictures.py, with playwright and Pillow."""

from __future__ import annotations

import io
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import sync_playwright

from conveyor_sim.runs.runner import run_scene
from conveyor_sim.scene import load_scene
from conveyor_sim.support.resources import scene_path
from conveyor_sim.view.one_file import write_page

ROOT = Path(__file__).resolve().parents[2]
IMAGES = ROOT / "docs" / "images"
FRAME = 80
"""ms of an animated picture: two frames of a page."""

sys.path.insert(0, str(ROOT / "test"))
from view.line import record  # noqa: E402


def line(page: Any) -> None:
    """The capper stands."""
    page.focus("#scrubber")
    for _ in range(16):
        page.keyboard.press("ArrowRight")


def bottle(page: Any) -> None:
    """The bottle that waits for it, dark."""
    line(page)
    page.click("#theme")
    x, y, scale, width, height = map(float, page.get_attribute("#plan", "data-camera").split())
    page.click("#plan", position={"x": width / 2 + (1.96 - x) * scale, "y": height / 2 + y * scale})
    page.keyboard.press("f")
    for _ in range(5):
        page.keyboard.press("+")
    page.select_option("#colour", "force")


PICTURES: dict[str, Callable[[Any], None]] = {"view_line": line, "view_bottle": bottle}


def animate(page: Any, path: Path, start: str, frames: int) -> None:
    """The plan alone from a tenth of the recording on, as it moves."""
    page.click("#toggle_trends")
    page.uncheck("#names")
    page.select_option("#colour", "force")
    page.keyboard.press(start)
    pictures = []
    for _ in range(frames):
        page.wait_for_timeout(60)
        pictures.append(Image.open(io.BytesIO(page.locator("#plan").screenshot())).convert("RGB"))
        page.keyboard.press(".")
        page.keyboard.press(".")
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=FRAME, loop=0, quality=40, method=6)


def main() -> None:
    """Record, write the pages, and take their pictures."""
    with tempfile.TemporaryDirectory() as name, sync_playwright() as driver:
        folder = Path(name)
        executable = shutil.which("chromium-headless-shell") or shutil.which("chromium")
        browser = driver.chromium.launch(executable_path=executable, args=["--no-sandbox"])

        def opened(bag: Path, width: int, height: int) -> Any:
            page = browser.new_page(viewport={"width": width, "height": height})
            page.goto(write_page(bag, bag.with_suffix(".html")).as_uri())
            page.wait_for_selector("body[data-ready]")
            return page

        bag = record(folder / "line")
        for picture, reach in PICTURES.items():
            page = opened(bag, 1280, 720)
            reach(page)
            page.wait_for_timeout(500)
            page.screenshot(path=IMAGES / f"{picture}.png")
        run_scene(load_scene(scene_path("paper_plant")), folder / "plant")
        animate(opened(folder / "plant", 1050, 460), IMAGES / "view_plant.webp", "7", 45)
        browser.close()


if __name__ == "__main__":
    main()
