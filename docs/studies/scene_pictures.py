# SPDX-License-Identifier: Apache-2.0
"""Pictures of layout, filler_block, brewery, check and build_a_line in docs: python docs/studies/scene_pictures.py.

Needs matplotlib and Pillow, as the tests do.
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

from part_pictures import draw_state, save_image
from PIL import Image

from conveyor_sim.control.brewery import brewery
from conveyor_sim.control.filler_block import filler_block
from conveyor_sim.control.scan import Controller
from conveyor_sim.report.figures.draw import plot_scene
from conveyor_sim.run.scan_loop import ScanLoop
from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.resources import scene_path

DOCS = Path(__file__).resolve().parents[1]
LAYOUT = DOCS / "layout.md"
CHECKED = {"check": "scenarios/two_stations", "build_a_line": DOCS.parent / "examples" / "my_line.yaml"}
"""Scenes that pages show as `check` draws them, by page."""
MOMENT = 22.0
"""Simulated time of the picture of the layout, s."""
RUNNING = 25.0
"""Simulated time of the picture of the filler block, s."""
PRODUCING = 60.0
"""Simulated time of the picture of the brewery, s."""


def example(folder: Path) -> Scene:
    """Write the files of docs/layout.md into a folder. Return the scene that uses them."""
    for name, text in re.findall(r"^```yaml\n# (\S+\.yaml)\n(.*?)^```", LAYOUT.read_text(), re.DOTALL | re.MULTILINE):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    return load_scene(folder / "line.yaml")


def started(scene: Scene, controller: Controller, until: float) -> Simulation:
    """Return a line whose start button was pressed at the beginning, at a time in s."""
    simulation = Simulation(scene, threads=1)
    scans = ScanLoop(simulation, controller)
    while simulation.time < until:
        if simulation.tick == 1:
            simulation.command(["panel/start/press"], [1.0], writer_kind="operator")
        scans.before_tick(None)
        simulation.advance()
    return simulation


def main() -> None:
    """Draw all pictures."""
    with tempfile.TemporaryDirectory() as folder:
        simulation = Simulation(example(Path(folder)), threads=1)
        simulation.advance(round(MOMENT / simulation.scene.tick))
        print(draw_state(simulation, DOCS / "images" / "layout.webp"))
        filling = started(load_scene(scene_path("filler_block")), filler_block(), RUNNING)
        print(draw_state(filling, DOCS / "images" / "filler_block.webp"))
        producing = started(load_scene(scene_path("brewery")), brewery(), PRODUCING)
        print(draw_state(producing, DOCS / "images" / "brewery.webp"))
        for page, scene in CHECKED.items():
            drawn = plot_scene(load_scene(scene_path(scene)), Path(folder) / page)
            print(save_image(Image.open(drawn).convert("RGB"), DOCS / "images" / f"{page}.webp"))


if __name__ == "__main__":
    main()
