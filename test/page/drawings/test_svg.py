# SPDX-License-Identifier: Apache-2.0
"""Plans as SVG: well-formed, with a group for each layer and an id for each part."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest
from scenes import SHIPPED, shipped_name

from conveyor_sim.page.drawings.plan import LAYERS, plan_of
from conveyor_sim.page.drawings.svg_plan import svg_of
from conveyor_sim.scene import load_scene

SVG = "{http://www.w3.org/2000/svg}"


@pytest.mark.parametrize("path", SHIPPED, ids=shipped_name)
def test_every_part_is_drawn_by_its_name(path: Path) -> None:
    shapes = plan_of(load_scene(path))
    root = ElementTree.fromstring(svg_of(shapes, "<a & b>"))
    groups = [group.get("id") for group in root.iter(f"{SVG}g")]
    assert groups == [layer for layer in LAYERS if layer in {shape.layer for shape in shapes}]
    ids = [drawn.get("id") for kind in ("path", "polygon") for drawn in root.iter(f"{SVG}{kind}")]
    assert sorted(map(str, ids)) == sorted(f"{shape.layer}/{shape.name}" for shape in shapes)
    x, y, width, height = map(float, str(root.get("viewBox")).split())
    for shape in shapes:
        at_x, at_y = shape.middle
        assert x <= 1000 * at_x <= x + width
        assert y <= -1000 * at_y <= y + height
