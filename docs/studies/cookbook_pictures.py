# SPDX-License-Identifier: Apache-2.0
"""Pictures of the pages in docs/cookbook/: python docs/studies/cookbook_pictures.py [NAME ...].

The line of a page runs with its controller until a moment at which the situation shows.
Needs matplotlib and Pillow, as the tests do.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from cookbook_pages import COOKBOOK, RECIPES, recipe_line
from part_pictures import draw_state

from conveyor_sim.testing import Scenario

IMAGES = COOKBOOK.parent / "images" / "cookbook"
MOMENT = 30.0
"""Simulated time of the pictures, s."""


ACTIONS: dict[str, Callable[[Scenario], None]] = {
    "side_transfer": lambda plant: plant.run_for(15.0),
    "single_filing": lambda plant: plant.run_for(36.0),
}
"""Actions before the picture of a page, by page. Others run for MOMENT."""


def draw(page: Path) -> Path:
    """Draw the picture of a page. Return its file."""
    with tempfile.TemporaryDirectory() as folder, recipe_line(page, Path(folder)) as plant:
        ACTIONS.get(page.stem, lambda plant: plant.run_for(MOMENT))(plant)
        return draw_state(plant.simulation, IMAGES / f"{page.stem}.webp")


def main() -> None:
    """Draw the pictures of the named pages, or of all pages."""
    for page in RECIPES:
        if not sys.argv[1:] or page.stem in sys.argv[1:]:
            print(draw(page), flush=True)


if __name__ == "__main__":
    main()
