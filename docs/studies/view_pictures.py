"""The pictures of docs/view.md, from the line that the page is tested with: python docs/studies/view_pictures.py.

Needs playwright and Chromium.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

from conveyor_sim.view.one_file import write_page

ROOT = Path(__file__).resolve().parents[2]
IMAGES = ROOT / "docs" / "images"

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


def main() -> None:
    """Record, write the page, and take its pictures."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        html = write_page(record(Path(folder) / "bag"), Path(folder) / "line.html")
        browser = driver.chromium.launch(
            executable_path=shutil.which("chromium-headless-shell") or shutil.which("chromium"), args=["--no-sandbox"]
        )
        for name, reach in PICTURES.items():
            page = browser.new_page(viewport={"width": 1280, "height": 720})
            page.goto(html.as_uri())
            page.wait_for_selector("body[data-ready]")
            reach(page)
            page.wait_for_timeout(500)
            page.screenshot(path=IMAGES / f"{name}.png")
            page.close()
        browser.close()


if __name__ == "__main__":
    main()
