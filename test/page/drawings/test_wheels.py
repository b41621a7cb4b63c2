# SPDX-License-Identifier: Apache-2.0
"""Star wheels, screws and side belts in plans and on the page."""

import math

import pytest
from scenes import ROOT
from study_page import load_study

from conveyor_sim.page.drawings.plan import plan_of
from conveyor_sim.page.head import plan_head
from conveyor_sim.scene import parse_scene
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.wheel_bodies import wheel_bodies


def part_scene(page: str) -> Scene:
    """Return the scene of a page in docs/parts/."""
    return parse_scene(load_study("part_pictures").scene_text(ROOT / "docs" / "parts" / f"{page}.md"))


def test_wheel_is_its_pitch_circle_in_a_plan() -> None:
    """It is closed; a screw is the line of its bottles."""
    scene = part_scene("stars")
    (star,) = [shape for shape in plan_of(scene) if shape.layer == "STARS"]
    assert star.is_closed and star.name == "in"
    assert sum(piece.length for piece in star.pieces) == pytest.approx(2.0 * math.pi * 0.3)
    (screw,) = [shape for shape in plan_of(scene) if shape.layer == "SCREWS"]
    assert (screw.pieces[0].start, screw.pieces[0].end) == (scene.screws["in"].from_, scene.screws["in"].to)


@pytest.mark.parametrize("page", ["stars", "screws", "side_belts"])
def test_page_has_the_outline_and_the_motion_of_each_body(page: str) -> None:
    """The outline of a wheel is closed; lags count from the first body of a machine."""
    scene = part_scene(page)
    bodies = plan_head(scene)["bodies"]
    assert [body["name"] for body in bodies] == [shape.name for shape in wheel_bodies(scene)]
    for body in bodies:
        shapes = [shape for shape in wheel_bodies(scene) if shape.name == body["name"]]
        assert body["lag"] in [shape.lag - shapes[0].lag for shape in shapes]
        if body["name"].startswith("stars/"):
            assert math.dist(body["outline"][0], body["outline"][-1]) < 1e-5
        assert (body["cam"] is None) == (not body["name"].startswith("screws/"))
