# SPDX-License-Identifier: Apache-2.0
"""The pages of docs/parts/: each has a scene that can be copied, and its picture."""

from __future__ import annotations

from pathlib import Path

import pytest
from study_page import load_study

from conveyor_sim.scene import parse_scene
from conveyor_sim.scene.reference import PAGES
from conveyor_sim.simulation import Simulation

ROOT = Path(__file__).parent.parent
PARTS = ROOT / "docs" / "parts"


@pytest.mark.parametrize("name", sorted(PAGES))
def test_the_scene_of_a_page_runs_without_a_report_of_the_guard(name: str) -> None:
    scene = parse_scene(load_study("part_pictures").scene_text(PARTS / f"{name}.md"))
    assert scene.name == name
    simulation = Simulation(scene, threads=1)
    simulation.advance(300)
    assert [event.text for event in simulation.take_events().guard] == []
    assert len(simulation.bottles().x) > 0


def test_each_page_has_a_picture_and_is_linked() -> None:
    index = (ROOT / "docs" / "scene.md").read_text() + (ROOT / "docs" / "line.md").read_text()
    for page in PARTS.glob("*.md"):
        assert f"](parts/{page.name})" in index
        if page.stem in PAGES:
            assert f"](../images/parts/{page.stem}.webp)" in page.read_text()
            assert (ROOT / "docs" / "images" / "parts" / f"{page.stem}.webp").exists()


@pytest.mark.parametrize("folder", ["performance", "ros"])
def test_pages_of_a_folder_are_linked_from_its_index(folder: str) -> None:
    index = (ROOT / "docs" / f"{folder}.md").read_text()
    pages = sorted((ROOT / "docs" / folder).glob("*.md"))
    assert pages
    assert [page.name for page in pages if f"]({folder}/{page.name})" not in index] == []
