# SPDX-License-Identifier: Apache-2.0
"""The page still looks as in the pictures of docs/, by eye: downsampled, for every machine has other fonts."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from page.conftest import opened_page
from page.states import FAILURE, SIZES, STATES, THEMES, views
from PIL import Image

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.page.one_file import write_page
from conveyor_sim.run.runner import run_scene
from conveyor_sim.scene import load_scene
from conveyor_sim.support.resources import scene_path

IMAGES = Path(__file__).resolve().parents[2] / "docs" / "images" / "page"
MOST_BYTES = 7_000_000
"""Bytes of all pictures of docs/, at most: those of the cookbook took them above 5 MB."""
BLOCK = 20
"""Size of a block that is reduced to one colour, px: about a word."""
OFF = 30.0
"""Least difference of a block that looks different, of 255, as the mean over the colours."""
ALLOWED = 0.045
"""Share of blocks that may. In other fonts (serif, monospaced, a fifth larger) 0.04 do, for words shift by a block;
between two of the states at least 0.05."""


def blocks(picture: Image.Image) -> np.ndarray:
    """The mean colours (rows, columns, 3) of its blocks."""
    width, height = picture.width // BLOCK, picture.height // BLOCK
    pixels = np.asarray(picture.convert("RGB"), dtype=np.float64)[: height * BLOCK, : width * BLOCK]
    return pixels.reshape(height, BLOCK, width, BLOCK, 3).mean(axis=(1, 3))


def different(one: np.ndarray, other: np.ndarray) -> float:
    """The share of blocks that look different."""
    return float((np.abs(one - other).mean(axis=2) > OFF).mean())


@pytest.fixture(scope="module")
def pages(bag: Path, other_bag: Path, tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Path]:
    folder = tmp_path_factory.mktemp("states")
    plant = folder / "plant"
    run_scene(load_scene(scene_path("paper_plant")), plant)
    return {
        "line": write_page(bag, folder / "line.html"),
        "failed": write_page(bag, folder / "failed.html", failures=[FAILURE], trends=[*FAILURE.values]),
        "pair": write_page(bag, folder / "pair.html", other=other_bag),
        "paper_plant": write_page(plant, folder / "plant.html"),
    }


@pytest.mark.parametrize("name", STATES)
def test_a_state_looks_as_in_its_pictures(browser: Any, pages: Mapping[str, Path], name: str) -> None:
    state = STATES[name]
    with opened_page(browser, pages[state.of]) as page:
        if state.of == "pair":
            page.wait_for_selector("body[data-compared]")
        state.reach(page)
        for view in views(page):
            shot = Image.open(io.BytesIO(page.screenshot()))
            known = Image.open(IMAGES / f"{name}-{view}.webp")
            assert shot.size == known.size
            share = different(blocks(shot), blocks(known))
            assert share <= ALLOWED, (
                f"{share:.1%} of {name}-{view} differs; `python docs/studies/view_pictures.py {name}` makes it anew"
            )


def test_the_condition_of_the_failed_state_has_the_recorded_values(bag: Path) -> None:
    with open_bag(bag) as recording:
        names = recording.line.signal_names
        image = next(frame.data for frame in recording.signals() if frame.time >= FAILURE.time)
    assert {name: image[names.index(name)] for name in FAILURE.values} == FAILURE.values


def test_states_are_told_apart() -> None:
    found = [blocks(Image.open(IMAGES / f"{name}-1280x720-light.webp")) for name in STATES]
    assert min(different(one, other) for i, one in enumerate(found) for other in found[:i]) > ALLOWED


def test_every_state_has_its_pictures_and_all_are_small() -> None:
    names = {
        f"{name}-{width}x{height}-{theme}.webp"
        for name in (*STATES, "live")
        for width, height in SIZES
        for theme in THEMES
    }
    assert {path.name for path in IMAGES.iterdir()} == names
    assert sum(path.stat().st_size for path in IMAGES.parent.rglob("*") if path.is_file()) <= MOST_BYTES
