# SPDX-License-Identifier: Apache-2.0
"""The scene: a user's description of a line, read, validated and turned into shapes."""

from conveyor_sim.scene.geometry import belt_shapes, initial_bottles, rail_shapes, surface_shapes
from conveyor_sim.scene.load import load_scene, parse_again, parse_scene
from conveyor_sim.scene.overrides import parse_overrides
from conveyor_sim.scene.schema import Scene

__all__ = [
    "Scene",
    "belt_shapes",
    "initial_bottles",
    "load_scene",
    "parse_again",
    "parse_overrides",
    "parse_scene",
    "rail_shapes",
    "surface_shapes",
]
