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
from typing import Any

from cookbook_pages import COOKBOOK, RECIPES, recipe_line
from part_pictures import draw_state

from conveyor_sim.testing import Scenario

IMAGES = COOKBOOK.parent / "images" / "cookbook"
MOMENT = 30.0
"""Simulated time of the pictures, s."""


def stop_packer(plant: Scenario) -> None:
    """Stop the packer at 26 s, and wait until the last zones are full."""
    plant.run_for(26.0)
    plant.inject("machines/packer/stop")
    plant.run_for(14.0)


def stop_filler(plant: Scenario) -> None:
    """Stop the filler from 10 s to 14 s."""
    plant.run_for(10.0)
    plant.inject("machines/filler/stop")
    plant.run_for(4.0)
    plant.inject("machines/filler/stop", 0.0)
    plant.run_for(16.0)


def press_start(plant: Scenario) -> None:
    """Press the start button, and wait until bottles come to the packer."""
    plant.run_for(2.0)
    plant.panel.press("start")
    plant.run_for(12.0)


def take_over(plant: Scenario) -> None:
    """Take the lane to manual at 2 s, and slow it down."""
    plant.run_for(2.0)
    plant.operator.mode("belts/lane", "manual")
    plant.operator.set("belts/lane/cmd_speed", 0.2)
    plant.run_for(10.0)


def turn_format(plant: Scenario) -> None:
    """Turn the selector to the other format at 10 s."""
    plant.run_for(10.0)
    plant.panel.turn("format", "third_litre")
    plant.run_for(4.0)


ACTIONS: dict[str, Callable[[Scenario], None]] = {
    "accumulation": lambda plant: plant.run_for(16.0),
    "changeover": turn_format,
    "hand_over": take_over,
    "jam": lambda plant: plant.run_for(3.0),
    "reject": lambda plant: plant.run_for(13.0),
    "downstream_stop": stop_packer,
    "v_curve": stop_filler,
    "emergency_stop": press_start,
    "side_transfer": lambda plant: plant.run_for(15.0),
    "single_filing": lambda plant: plant.run_for(36.0),
}
"""Actions before the picture of a page, by page. Others run for MOMENT."""
WEDGE = [{"type": "bottle", "position": place} for place in ([0.3384, 0.026], [0.3104, -0.034])]
OVERRIDES: dict[str, dict[str, Any]] = {"jam": {"bottles": WEDGE}}
"""Changes of the scene for the picture, by page."""


def draw(page: Path) -> Path:
    """Draw the picture of a page. Return its file."""
    overrides = OVERRIDES.get(page.stem)
    with tempfile.TemporaryDirectory() as folder, recipe_line(page, Path(folder), overrides) as plant:
        ACTIONS.get(page.stem, lambda plant: plant.run_for(MOMENT))(plant)
        return draw_state(plant.simulation, IMAGES / f"{page.stem}.webp")


def main() -> None:
    """Draw the pictures of the named pages, or of all pages."""
    for page in RECIPES:
        if not sys.argv[1:] or page.stem in sys.argv[1:]:
            print(draw(page), flush=True)


if __name__ == "__main__":
    main()
