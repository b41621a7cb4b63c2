# SPDX-License-Identifier: Apache-2.0
"""The page of `conveyor-sim check --watch` in a browser: it follows a scene's files as editors save them."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from page.drawings.test_underlay import png
from page.pixels import canvas, settled

from conveyor_sim.page.check_server import CheckServer
from conveyor_sim.report.check_page import CheckPage

SCENE = """name: written
duration: 10
bottle_types: {bottle: {radius: 0.03, mass: 0.3, material: glass}}
contacts:
- {between: [glass, glass], table: table.csv, friction: 0.1}
base:
- {between: [glass, chain], friction: 0.2}
belts:
  main: {kind: straight, start: [0, 0], angle: 0, length: 2, width: 0.1, speed: 0.3, material: chain}
photo_eyes:
  full: {from: [1, -0.1], to: [1, 0.2]}
outfeeds:
  end: {region: [[1.9, 0], [2, 0], [2, 0.1], [1.9, 0.1]]}
bottles:
- {type: bottle, position: [0.1, 0.05]}
"""
TABLE = "overlap,force\n0.001,10\n0.002,20\n"


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    (tmp_path / "table.csv").write_text(TABLE)
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    return path


@pytest.fixture
def server(scene: Path) -> Iterator[CheckServer]:
    with CheckServer(CheckPage(scene).examine) as made:
        yield made


@pytest.fixture
def shown(server: CheckServer, open_page: Callable[[str], Any]) -> Any:
    return open_page(server.url)


def problems(page: Any) -> list[str]:
    return [row.inner_text() for row in page.locator("#problems li").all()]


def saved(page: Any, save: Callable[[], object]) -> None:
    """Save something, and wait until the page shows what became of it."""
    number = page.get_attribute("body", "data-number")
    save()
    page.wait_for_selector(f'body:not([data-number="{number}"])')


def replaced(path: Path, text: str) -> None:
    """Write a file as editors do: beside the old one, and then in its place."""
    beside = path.with_suffix(".swp")
    beside.write_text(text)
    os.replace(beside, path)


def test_the_plan_is_drawn(shown: Any) -> None:
    assert shown.locator("#state").inner_text() == "valid"
    assert shown.title() == "written"
    assert len({tuple(pixel) for pixel in canvas(shown).reshape(-1, canvas(shown).shape[-1])}) > 5
    assert shown.locator("#problems .error").count() == 0


def test_problems_are_shown_at_their_places(shown: Any, scene: Path) -> None:
    saved(shown, lambda: scene.write_text(SCENE.replace("to: [1, 0.2]", "to: [1, -0.1]")))
    assert shown.locator("#state").get_attribute("class") == "invalid"
    (row,) = problems(shown)
    assert "scene.yaml:11" in row
    assert "photo_eyes.full" in row
    spot = shown.locator("#spots button.error")
    assert json.loads(spot.get_attribute("data-at")) == pytest.approx([1.0, 0.05])
    before = canvas(shown)
    saved(shown, lambda: scene.write_text(SCENE))
    assert shown.locator("#spots button.error").count() == 0
    assert (canvas(shown) == before).all()


def test_half_saved_files_keep_the_last_plan(shown: Any, scene: Path) -> None:
    before = canvas(shown)
    for text in (SCENE[: len(SCENE) // 2], "belts: {", "", "\t\x00"):
        saved(shown, lambda text=text: scene.write_text(text))
        assert shown.locator("#state").get_attribute("class") == "invalid"
        assert shown.locator("#problems .error").count() >= 1
        assert (canvas(shown) == before).all()
    saved(shown, scene.unlink)
    assert "no such file" in problems(shown)[0]
    saved(shown, lambda: scene.write_text(SCENE.replace("length: 2", "length: 4")))
    assert shown.locator("#state").inner_text() == "valid"
    assert (canvas(shown) != before).any()


def test_replaced_files_and_files_that_the_scene_uses(shown: Any, scene: Path) -> None:
    table = scene.with_name("table.csv")
    saved(shown, lambda: replaced(scene, SCENE.replace("name: written", "name: replaced")))
    assert shown.title() == "replaced"
    saved(shown, lambda: replaced(table, "overlap,force\n0.002,10\n0.001,20\n"))
    assert "contacts[0].table" in problems(shown)[0]
    saved(shown, table.unlink)
    assert "table.csv" in problems(shown)[0]
    saved(shown, lambda: table.write_text(TABLE))
    assert shown.locator("#state").inner_text() == "valid"


def test_a_scene_that_was_never_valid(tmp_path: Path, open_page: Callable[[str], Any]) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text("name: <script>alert(1)</script>\n")
    (tmp_path / "table.csv").write_text(TABLE)
    with CheckServer(CheckPage(path).examine) as server:
        page = open_page(server.url)
        assert page.locator("#state").get_attribute("class") == "invalid"
        saved(page, lambda: path.write_text(SCENE))
        assert page.title() == "written"


def test_a_finding_leads_to_its_place(shown: Any, scene: Path) -> None:
    saved(
        shown,
        lambda: scene.write_text(
            SCENE.replace("  full: {from: [1, -0.1], to: [1, 0.2]}", "  full: {from: [1, 3], to: [1, 4]}")
        ),
    )
    row = shown.locator("#problems li", has_text="photo_eyes.full")
    assert row.count() == 1
    row.click()
    assert shown.locator("#problems li.chosen").count() == 1
    spot = shown.locator('#spots button[data-path^="photo_eyes.full"]')
    assert json.loads(spot.get_attribute("data-at")) == pytest.approx([1.0, 3.5])


def test_included_files_are_followed(shown: Any, scene: Path) -> None:
    """A file that is missing at first counts as well."""
    part = scene.parent / "parts" / "more.yaml"
    saved(shown, lambda: scene.write_text(f"include: parts/more.yaml\n{SCENE}"))
    assert shown.locator("#state").get_attribute("class") == "invalid"
    part.parent.mkdir()
    saved(shown, lambda: part.write_text("zones:\n  area: {region: [[0, 0], [1, 0], [1, 0.1]]}\n"))
    assert shown.locator("#state").inner_text() == "valid"
    saved(shown, lambda: replaced(part, "zones:\n  area: {region: [[0, 0], [1, 0]]}\n"))
    assert "more.yaml:2" in problems(shown)[0]
    assert json.loads(shown.locator("#spots button.error").get_attribute("data-at"))


def test_an_underlay_is_shown(shown: Any, scene: Path) -> None:
    image = scene.with_name("plan.png")
    image.write_bytes(png(300, 100))
    saved(
        shown,
        lambda: scene.write_text(
            f"{SCENE}underlay: {{file: plan.png, scale: 10 mm, position: [0, -0.5], opacity: 1}}\n"
        ),
    )
    shown.wait_for_selector('body[data-underlay="shown"]')
    settled(shown)
    assert (canvas(shown) == [255, 0, 0]).all(axis=-1).any()
    saved(shown, lambda: image.write_bytes(b"GIF89a"))
    assert "underlay.file" in problems(shown)[0]
    assert not (canvas(shown) == [255, 0, 0]).all(axis=-1).any()
