# SPDX-License-Identifier: Apache-2.0
"""Draw hall.dxf, the plan of docs/tutorial_line.md.

The building, the blocks of the equipment and all texts come from ezdxf. LibreCAD 2.2 opens that file; the conveyors and
guides are drawn by its commands, and LibreCAD saves the plan. Needs librecad, xdotool and an empty X server of
1500 x 1000 pixels (Xvfb), on which LibreCAD was started once before.
"""

import math
import subprocess
import sys
import time
from pathlib import Path

import ezdxf
from ezdxf.document import Drawing
from ezdxf.enums import TextEntityAlignment

COLOURS = {
    "A-COLS": 8,
    "A-GRID": 9,
    "A-TEXT": 8,
    "A-WALL": 8,
    "A-WALL-PATT": 9,
    "F-CONV-COMB": 5,
    "F-CONV-LANE": 5,
    "F-CONV-TABLE": 5,
    "F-EQUIP": 1,
    "F-FENCE": 30,
    "F-GUIDE": 3,
    "F-SENSOR": 6,
    "G-ANNO-DIMS": 2,
    "G-ANNO-TTLB": 7,
}
WIDTH, DEPTH = 14000, 9000  # mm
EQUIPMENT = {
    "FEED": (120, 60),
    "FILLER": (1000, 700),
    "CAMERA": (200, 200),
    "REJECTER": (300, 200),
    "PACKER": (1200, 900),
}
PLACED = [
    ("FEED", 1600, 5870, 0, "IN1", -350, 20),
    ("FEED", 1600, 6000, 0, "IN2", -350, 20),
    ("FEED", 1600, 6130, 0, "IN3", -350, 20),
    ("FILLER", 6900, 6150, 0, "FILLER", -300, 300),
    ("CAMERA", 8900, 4700, -90, "CAM1", 150, 150),
    ("REJECTER", 8900, 3980, -90, "REJ1", 150, 150),
    ("PACKER", 3400, 3200, 180, "PACKER", -300, -300),
]
EYES = [(6200, 6150, 0, "PE01"), (8200, 3200, 180, "PE02"), (4600, 3200, 180, "PE03")]
LABELS = [
    ("TB01", 2100, 6060, "TABLE"),
    ("CB02", 4100, 5820, "COMB"),
    ("C03", 6500, 6250, "LANE"),
    ("C04", 8000, 6250, "LANE"),
    ("C05", 8560, 4250, "LANE"),
]
COMMANDS = {
    "F-CONV-TABLE": ["li 1500,6000 3000,6000"],
    "F-CONV-COMB": ["li 3000,6000 5600,6000"],
    "F-CONV-LANE": [
        "li 5600,6150 7600,6150",
        "li 5600,6150 7600,6150",  # the same line a second time
        "pl 7600,6150 8900,6150 8900,4900",
        "li 8900,4900 8900,3700",
        "spline 8900,3700 8900,3423.858 8676.142,3200 8400,3200",
        "li 8400,3200 6003,3200",
        "li 6000,3200 3400,3200",  # a gap of 3 mm before it
    ],
    "F-GUIDE": [
        "li 1500,6188 5600,6188",
        "pl 1500,5812 3000,5812 5400,6112 5600,6112",
        "li 6900,6105 6900,6195",
        "li 3400,3155 3400,3245",
    ],
}


def template() -> Drawing:
    """Return the building with blocks and texts, but without conveyors."""
    drawing = ezdxf.new("R2007", units=4, setup=True)
    space = drawing.modelspace()
    for layer, colour in COLOURS.items():
        drawing.layers.add(layer, color=colour)

    def box(target: object, layer: str, low: tuple[float, float], high: tuple[float, float]) -> None:
        corners = [low, (high[0], low[1]), high, (low[0], high[1])]
        target.add_lwpolyline(corners, close=True, dxfattribs={"layer": layer})  # type: ignore[attr-defined]

    def text(content: str, layer: str, height: float, x: float, y: float) -> None:
        space.add_text(content, height=height, dxfattribs={"layer": layer}).set_placement((x, y))

    box(space, "A-WALL", (0, 0), (WIDTH, DEPTH))
    box(space, "A-WALL", (-300, -300), (WIDTH + 300, DEPTH + 300))
    hatch = space.add_hatch(color=9, dxfattribs={"layer": "A-WALL-PATT"})
    hatch.set_pattern_fill("ANSI31", scale=40)
    hatch.paths.add_polyline_path([(-300, -300), (WIDTH + 300, -300), (WIDTH + 300, 0), (-300, 0)], is_closed=True)
    column = drawing.blocks.new("COLUMN")
    box(column, "0", (-150, -150), (150, 150))
    column.add_line((-150, -150), (150, 150), dxfattribs={"layer": "0"})
    for name, x in zip("ABCD", (0, 4700, 9400, WIDTH), strict=True):
        for y in (0, DEPTH):
            space.add_blockref("COLUMN", (x, y), dxfattribs={"layer": "A-COLS"})
        space.add_line((x, -1500), (x, DEPTH + 900), dxfattribs={"layer": "A-GRID", "linetype": "CENTER"})
        space.add_circle((x, -1800), 300, dxfattribs={"layer": "A-GRID"})
        mark = space.add_text(name, height=300, dxfattribs={"layer": "A-GRID"})
        mark.set_placement((x, -1800), align=TextEntityAlignment.MIDDLE_CENTER)
    text("FILLING HALL 2  +0.00", "A-TEXT", 300, 5200, 8200)
    fence = [(900, 6900), (9900, 6900), (9900, 2300), (900, 2300)]
    space.add_lwpolyline(fence, dxfattribs={"layer": "F-FENCE"})
    box(space, "G-ANNO-TTLB", (9000, -4200), (14300, -2500))
    space.add_line((9000, -3400), (14300, -3400), dxfattribs={"layer": "G-ANNO-TTLB"})
    title = {"layer": "G-ANNO-TTLB", "char_height": 250, "insert": (9200, -2650)}
    space.add_mtext("LINE 2, GLASS 0.33 l\\PLAYOUT PLAN 1:50   REV C", dxfattribs=title)
    text("drawn: plant engineering", "G-ANNO-TTLB", 200, 9200, -3900)
    for (x0, y0), x1, y in (((1500, 6000), 3000, 7300), ((3000, 6000), 5600, 7300), ((5600, 6150), 7600, 7300)):
        dimension = space.add_linear_dim((x0, y), (x0, y0), (x1, y0), override={"dimtxt": 150, "dimasz": 100})
        dimension.dimension.dxf.layer = "G-ANNO-DIMS"
        dimension.render()
    for label, x, y, layer in LABELS:
        text(label, f"F-CONV-{layer}", 120, x, y)
    for name, (width, depth) in EQUIPMENT.items():
        block = drawing.blocks.new(name)
        box(block, "0", (-width / 2, 60), (width / 2, depth + 60))
        block.add_line((-width / 2, 60), (width / 2, depth + 60), dxfattribs={"layer": "0"})
    eye = drawing.blocks.new("PEC")
    eye.add_circle((0, 90), 30, dxfattribs={"layer": "0"})
    eye.add_line((0, 90), (0, -60), dxfattribs={"layer": "0"})
    for name, x, y, turn, tag, dx, dy in PLACED:
        space.add_blockref(name, (x, y), dxfattribs={"layer": "F-EQUIP", "rotation": turn})
        text(tag, "F-EQUIP", 100, x + dx, y + dy)
    for x, y, turn, tag in EYES:
        space.add_blockref("PEC", (x, y), dxfattribs={"layer": "F-SENSOR", "rotation": turn})
        text(tag, "F-SENSOR", 100, x + 60, y + (100 if math.cos(math.radians(turn)) > 0 else -200))
    return drawing


def press(*words: object) -> None:
    """Send one input to LibreCAD."""
    subprocess.run(["xdotool", *map(str, words)], check=True)
    time.sleep(0.15)


def draw(file: Path) -> None:
    """Draw conveyors and guides in LibreCAD, and save the file."""
    librecad = subprocess.Popen(["librecad", str(file)])
    time.sleep(5)
    found = subprocess.run(
        ["xdotool", "search", "--onlyvisible", "--name", "LibreCAD"], capture_output=True, check=True
    )
    window = found.stdout.split()[-1].decode()
    press("windowsize", window, 1450, 950, "windowmove", window, 0, 0)
    time.sleep(2)
    for layer, commands in COMMANDS.items():
        press("mousemove", 1250, 363, "click", 1)  # filter of the list of layers
        press("key", "ctrl+a")
        press("type", "--delay", 15, layer)
        press("key", "Return")
        time.sleep(0.4)
        press("mousemove", 1325, 427, "click", 1)  # its first row: makes the layer the current one
        time.sleep(0.3)
        for command in commands:
            press("mousemove", 1250, 832, "click", 1)  # command line
            for word in command.split():
                press("type", "--delay", 15, word)
                press("key", "Return")
            press("key", "Escape")
            press("key", "Escape")
    press("mousemove", 1250, 832, "click", 1)
    press("type", "za")
    press("key", "Return")
    time.sleep(1)
    press("mousemove", 600, 300)
    press("key", "ctrl+s")
    time.sleep(2)
    librecad.terminate()
    librecad.wait()


if __name__ == "__main__":
    plan = Path(sys.argv[1])
    template().saveas(plan)
    draw(plan)
