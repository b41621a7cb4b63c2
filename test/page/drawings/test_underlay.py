# SPDX-License-Identifier: Apache-2.0
"""Underlays: shown on pictures and pages, held by recordings, and without effect on what is simulated."""

from __future__ import annotations

import base64
import os
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conveyor_sim.page.drawings.underlay import ShownUnderlay, shown_underlay
from conveyor_sim.page.head import plan_head
from conveyor_sim.report.flow.flow import hidden_underlay
from conveyor_sim.scene import Scene, load_scene, parse_overrides, parse_scene
from conveyor_sim.simulation import Simulation

SCENE = """name: drawn
duration: 1
bottle_types: {bottle: {radius: 0.03, mass: 0.3, material: glass}}
contacts:
- {between: [glass, glass], stiffness: 1e4}
base:
- {between: [glass, chain], friction: 0.2}
belts:
  main: {kind: straight, start: [0, 0], angle: 0, length: 1, width: 0.1, speed: 0.3, material: chain}
bottles:
- {type: bottle, position: [0.1, 0.05]}
"""
DXF = """  0
SECTION
  2
ENTITIES
  0
LINE
  8
0
 10
0
 20
0
 11
1000
 21
500
  0
ENDSEC
  0
EOF
"""


def png(width: int = 4, height: int = 2, colour: tuple[int, int, int] = (255, 0, 0)) -> bytes:
    """Return an image of one colour."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    rows = (b"\0" + bytes(colour) * width) * height
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def written(folder: Path, underlay: str, **files: bytes) -> Scene:
    for name, content in {"plan.png": png(), "plan.dxf": DXF.encode(), **files}.items():
        (folder / name).write_bytes(content)
    (folder / "scene.yaml").write_text(f"{SCENE}underlay: {underlay}\n")
    return load_scene(folder / "scene.yaml")


def shown(scene: Scene) -> ShownUnderlay:
    underlay = shown_underlay(scene)
    assert isinstance(underlay, ShownUnderlay)
    return underlay


def test_an_image(tmp_path: Path) -> None:
    scene = written(tmp_path, "{file: plan.png, scale: 5 mm, position: [1, -2], angle: 90 deg, opacity: 0.3}")
    underlay = shown(scene)
    assert (underlay.position, underlay.pixel, underlay.opacity) == ((1.0, -2.0), 0.005, 0.3)
    assert base64.b64decode(underlay.image.removeprefix("data:image/png;base64,")) == png()
    head: dict[str, Any] = plan_head(scene)
    assert head["underlay"]["image"] == underlay.image
    assert list(hidden_underlay(scene)) == []


@pytest.mark.parametrize(("scale", "end"), [(", scale: 2 mm", [2, 1]), (", scale: 1 in", [25.4, 12.7])])
def test_a_drawing(tmp_path: Path, scale: str, end: list[float]) -> None:
    pytest.importorskip("ezdxf", reason="ezdxf is not installed: pip install conveyor-sim[cad]")
    (line,) = shown(written(tmp_path, f"{{file: plan.dxf{scale}}}")).lines
    assert line == [[0, 0], pytest.approx(end)]


def test_nothing_that_is_simulated_depends_on_it(tmp_path: Path) -> None:
    hashes = []
    for scene in (written(tmp_path, "{file: plan.png}"), written(tmp_path, "{file: missing.png}"), parse_scene(SCENE)):
        simulation = Simulation(scene)
        simulation.advance(50)
        hashes.append(simulation.state_hash())
    assert len(set(hashes)) == 1


def test_recordings_hold_the_file(tmp_path: Path) -> None:
    scene = written(tmp_path, "{file: plan.png}")
    os.remove(tmp_path / "plan.png")
    again = parse_scene(scene.source_text, "recorded", parse_overrides(scene.overrides_text))
    assert shown(again) == shown(scene)
    third = parse_scene(again.source_text, "recorded", parse_overrides(again.overrides_text))
    assert shown(third) == shown(scene)


@pytest.mark.parametrize(
    ("underlay", "files", "expected"),
    [
        ("{file: missing.png}", {}, "missing.png"),
        ("{file: plan.gif}", {}, "plan.gif"),
        ("{file: ../plan.png}", {}, "../plan.png"),
        ("{file: plan.png}", {"plan.png": b"GIF89a"}, "not an image"),
        ("{file: plan.png}", {"plan.png": bytes(4_100_000)}, "4 MB"),
        ("{file: plan.jpg}", {"plan.jpg": png()}, "not an image"),
        ("{file: plan.dxf}", {}, "unit"),
        ("{file: plan.dxf, scale: 1 mm}", {"plan.dxf": DXF[:-8].encode()}, "EOF"),
        ("{file: plan.dxf, scale: 1 mm}", {"plan.dxf": DXF.replace("1000", "nan").encode()}, "nan"),
    ],
)
def test_what_cannot_be_shown_is_a_finding(
    tmp_path: Path, underlay: str, files: dict[str, bytes], expected: str
) -> None:
    pytest.importorskip("ezdxf", reason="ezdxf is not installed: pip install conveyor-sim[cad]")
    scene = written(tmp_path, underlay, **files)
    (finding,) = hidden_underlay(scene)
    assert finding.path == ("underlay", "file")
    assert expected in finding.text
    assert plan_head(scene)["underlay"] is None


@pytest.mark.parametrize("colours", [{"plan.png": png(40, 20)}, {"plan.png": png(40, 20)[:40]}], ids=["intact", "cut"])
def test_pictures(tmp_path: Path, colours: dict[str, bytes]) -> None:
    pytest.importorskip("matplotlib", reason="matplotlib is not installed: pip install conveyor-sim[plot]")
    from matplotlib.image import imread

    from conveyor_sim.report.figures.draw import plot_scene

    scene = written(tmp_path, "{file: plan.png, scale: 20 mm, position: [0, -0.15], opacity: 1}", **colours)
    pixels = imread(plot_scene(scene, tmp_path / "drawn.png"))[:, :, :3]
    red = np.all(np.abs(pixels - [1.0, 0.0, 0.0]) < 0.02, axis=2)
    assert red.any() == (colours["plan.png"] == png(40, 20))
