# SPDX-License-Identifier: Apache-2.0
"""Pictures of the pages in docs/parts/: python docs/studies/part_pictures.py [NAME ...].

Each page has a scene as YAML. The scene is simulated until MOMENT, and drawn with the forces between bottles.
Needs matplotlib and Pillow, as the tests do. Without names all pictures are drawn, in about two minutes. The picture of
the operator panel is one of the web page, by view_pictures.py.
"""

from __future__ import annotations

import io
import re
import sys
from pathlib import Path

import numpy as np
from PIL import Image

from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import PlantFrame, StaticGeometry
from conveyor_sim.report.figures.recording import contact_lines
from conveyor_sim.report.figures.views import plant_figure
from conveyor_sim.scene import parse_scene
from conveyor_sim.simulation import Simulation

ROOT = Path(__file__).resolve().parents[2]
PARTS = ROOT / "docs" / "parts"
IMAGES = ROOT / "docs" / "images" / "parts"
MOMENT = 8.0
"""Simulated time of the pictures, s."""
MOMENTS = {
    "accuracy": 14.0,
    "alarms": 14.0,
    "axes": 14.0,
    "bottles": 0.5,
    "carousels": 18.0,
    "failures": 120.0,
    "rows": 17.1,
    "stations": 20.0,
    "zones": 14.0,
}
"""Simulated times of pages whose scenes show more at another time, s."""
COMMANDS = {"stoppers": {5.0: "clamps/grip/close"}}
"""Commands that are switched on at simulated times, s, by page."""
WIDTH = 960
"""Width of a picture, px."""


def scene_text(page: Path) -> str:
    """Return the first scene of a page. Raise ValueError if it has none."""
    match = re.search(r"^```yaml\n(name: .*?)^```$", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    if match is None:
        raise ValueError(f"{page}: expected a block of YAML that begins with `name:`")
    return match[1]


def draw(page: Path) -> Path:
    """Simulate the scene of a page and draw it. Return the picture."""
    simulation = Simulation(parse_scene(scene_text(page)), threads=1)
    ticks = round(MOMENTS.get(page.stem, MOMENT) / simulation.scene.tick)
    for time, command in COMMANDS.get(page.stem, {}).items():
        simulation.advance(round(time / simulation.scene.tick) - simulation.tick)
        simulation.command([command], [1.0])
    simulation.advance(ticks - simulation.tick)
    return draw_state(simulation, IMAGES / f"{page.stem}.webp")


def draw_state(simulation: Simulation, file: Path) -> Path:
    """Draw the present state of a simulation with the forces between bottles. Return the picture."""
    bottles = simulation.bottles()
    frame = PlantFrame(
        time=simulation.time,
        x=bottles.x,
        y=bottles.y,
        theta=bottles.theta,
        radius=np.asarray(simulation.model.type_radius)[bottles.type],
        speed=np.hypot(bottles.vx, bottles.vy),
        belt_speeds=simulation.belts().actual,
        contacts=contact_lines(bottles, simulation.contacts()),
        moving=simulation.moving_rails(),
    )
    with style.look():
        figure = plant_figure(StaticGeometry.of(simulation.scene), frame, simulation.scene.name)
        image = Image.open(io.BytesIO(style.rendered(figure, (".png",))[".png"])).convert("RGB")
    return save_image(image, file)


def save_image(image: Image.Image, file: Path) -> Path:
    """Save a picture with at most WIDTH pixels a side. Return its file."""
    image.thumbnail((WIDTH, WIDTH))
    file.parent.mkdir(parents=True, exist_ok=True)
    image.save(file, quality=60, method=6)
    return file


def main() -> None:
    """Draw the pictures of the named pages, or of all pages with a picture."""
    drawn = [page.stem for page in sorted(PARTS.glob("*.md")) if "images/parts/" in page.read_text()]
    names = sys.argv[1:] or [name for name in drawn if name != "panel"]
    for name in names:
        print(draw(PARTS / f"{name}.md"), flush=True)


if __name__ == "__main__":
    main()
