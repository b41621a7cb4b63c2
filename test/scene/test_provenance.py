# SPDX-License-Identifier: Apache-2.0
"""Provenance: fields of expanded data are reported at the place that they were written at."""

from conveyor_sim.scene.provenance import Provenance, SceneFile, Sources
from conveyor_sim.scene.yaml_lines import Document

SCENE = "conveyors:\n  lane:\n    width: 1\n    speed: 2\n"
CELL = "conveyors:\n  a:\n    width: 3\n"


def test_the_longest_prefix_decides() -> None:
    provenance = Provenance({("belts",): ("old",), ("belts", "lane"): ("conveyors", "lane")})
    assert provenance.source_of(("belts", "lane", "speed")) == ("conveyors", "lane", "speed")
    assert provenance.source_of(("belts", "other")) == ("old", "other")
    assert provenance.source_of(("rails", "x")) == ("rails", "x")


def test_a_field_has_the_line_of_its_file() -> None:
    sources = Sources(SceneFile("plant.yaml", Document(SCENE, "plant.yaml")), {"conveyors": {"lane": {"speed": 5}}})
    cell = SceneFile("cell.yaml", Document(CELL, "cell.yaml"), "block")
    sources.add(("conveyors", "block_a"), cell, ("conveyors", "a"))
    assert str(sources.place_of(("conveyors", "lane", "width"))) == "plant.yaml:3"
    assert sources.place_of(("conveyors", "lane", "speed")).line is None
    place = sources.place_of(("conveyors", "block_a", "width"))
    assert (place.file, place.line, place.cell, place.path) == ("cell.yaml", 3, "block", ("conveyors", "a", "width"))
