# SPDX-License-Identifier: Apache-2.0
"""A recording of the line that the page is tested with, and a real browser without a network to open it in."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from page.line import LINE, record
from page.live_line import PASSWORD, PEOPLE, Live
from protocols.waiting import PATIENCE

from conveyor_sim.page.one_file import FailedCondition, write_page
from conveyor_sim.protocols.server.users import keep_user, new_user
from conveyor_sim.protocols.tags.scene_messages import SceneTask
from conveyor_sim.protocols.tags.scene_provider import SceneTagProvider
from conveyor_sim.scene import load_scene

BROWSERS = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")


@pytest.fixture(scope="session")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The line, recorded for 24 s. Not to be written to."""
    return record(tmp_path_factory.mktemp("view") / "bag")


@pytest.fixture(scope="session")
def other_bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a recording in which the gate does not close at 6 s. Tests must not write to it."""
    return record(tmp_path_factory.mktemp("view") / "other", closes=False)


@pytest.fixture(scope="session")
def html(bag: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the page of `bag` as one file, with a condition that failed at 22 s."""
    failures = [FailedCondition(22.0, "always: no more than 20 bottles <script>alert(3)</script>")]
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
def opened_page(
    browser: Any, html: Path, size: tuple[int, int] = (1280, 720), script: str = "", part: str = ""
) -> Iterator[Any]:
    """Open a file as `page` does, in a window of a size in px.

    script: runs before those of the page. part: follows the address, with "#".
    """
    context = browser.new_context(viewport={"width": size[0], "height": size[1]}, offline=True)
    context.set_default_timeout(60_000)
    opened, wrong = context.new_page(), []
    opened.on("pageerror", lambda error: wrong.append(str(error)))
    opened.on("console", lambda message: message.type == "error" and wrong.append(message.text))
    opened.on("dialog", lambda dialog: (wrong.append(dialog.message), dialog.dismiss()))
    opened.add_init_script(script)
    opened.goto(html.as_uri() + part)
    opened.wait_for_selector("body[data-ready]")
    yield opened
    context.close()
    assert wrong == []


@pytest.fixture(scope="module")
def users(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("users")
    for name, role in PEOPLE.items():
        keep_user(folder / "users", name, new_user(role, PASSWORD))
    return folder


@pytest.fixture(scope="module")
def live(users: Path) -> Iterator[Live]:
    """The line, in real time, recorded; its end is an hour away."""
    pytest.importorskip("aiohttp", reason="aiohttp is not installed: pip install conveyor-sim[scada]")
    scene = load_scene(LINE, {"duration": 3600.0})
    with SceneTagProvider(SceneTask(scene, users / "bag", 0, 1.0, 1), lambda text: None) as source:
        source.wait_for_line()
        made = Live(users, source)
        made.serve()
        yield made
        made.end()


@pytest.fixture
def open_page(browser: Any) -> Iterator[Callable[[str], Any]]:
    """Opens a page that has begun; anything that goes wrong in it fails the test, but for the network."""
    contexts, wrong = [], []

    def open_it(url: str) -> Any:
        contexts.append(browser.new_context(viewport={"width": 1280, "height": 720}, ignore_https_errors=True))
        contexts[-1].set_default_timeout(PATIENCE * 1e3)
        page = contexts[-1].new_page()
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("dialog", lambda dialog: (wrong.append(dialog.message), dialog.dismiss()))
        page.goto(url)
        page.wait_for_selector("body[data-ready]")
        return page

    yield open_it
    for context in contexts:
        context.close()
    assert wrong == []
