"""A recording of the line that the page is tested with, and a real browser without a network to open it in."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from view.line import record

from conveyor_sim.view.one_file import Failure, write_page

BROWSERS = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")


@pytest.fixture(scope="session")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The line, recorded for 24 s. Not to be written to."""
    return record(tmp_path_factory.mktemp("view") / "bag")


@pytest.fixture(scope="session")
def other_bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same, but the gate does not close at 6 s. Not to be written to."""
    return record(tmp_path_factory.mktemp("view") / "other", closes=False)


@pytest.fixture(scope="session")
def html(bag: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same as one file, with a condition that failed at 22 s."""
    failures = [Failure(22.0, "always: no more than 20 bottles <script>alert(3)</script>")]
    return write_page(bag, tmp_path_factory.mktemp("page") / "line.html", failures=failures)


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Chromium, without a window."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        pytest.skip(f"no browser: expected one of {', '.join(BROWSERS)}")
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=found, args=["--no-sandbox"])
        yield opened
        opened.close()


@pytest.fixture
def page(browser: Any, html: Path) -> Iterator[Any]:
    """The one-file page at 1280 x 720, with the network off; anything that goes wrong in it fails the test."""
    with opened_page(browser, html) as opened:
        yield opened


@contextmanager
def opened_page(browser: Any, html: Path, size: tuple[int, int] = (1280, 720)) -> Iterator[Any]:
    """As `page`, on some file, in a window of some size in px."""
    context = browser.new_context(viewport={"width": size[0], "height": size[1]}, offline=True)
    context.set_default_timeout(60_000)
    opened, wrong = context.new_page(), []
    opened.on("pageerror", lambda error: wrong.append(str(error)))
    opened.on("console", lambda message: message.type == "error" and wrong.append(message.text))
    opened.on("dialog", lambda dialog: (wrong.append(dialog.message), dialog.dismiss()))
    opened.goto(html.as_uri())
    opened.wait_for_selector("body[data-ready]")
    yield opened
    context.close()
    assert wrong == []
