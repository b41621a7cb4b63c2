# SPDX-License-Identifier: Apache-2.0
"""A line for optimisations: an empty belt, whose speed is all that counts. A run takes milliseconds."""

from __future__ import annotations

import random

from conveyor_sim.scene import Scene, parse_scene
from conveyor_sim.simulation import Simulation

LINE = """
name: one_belt
duration: 0.1
accuracy: draft
bottle_types: {bottle: {radius: 0.03, mass: 0.3, material: glass}}
contacts: [{between: [glass, glass], stiffness: 5000}]
base: [{between: [glass, chain], friction: 0.4}]
belts: {belt: {kind: straight, start: [0, -0.1], angle: 0, length: 3, width: 0.2, speed: 0.5, material: chain}}
"""

STUDY = """
name: parabola
function: optimised.py:line
parameters:
  speed: {{field: belts.belt.speed, low: 0.1, high: 0.9}}
  kind: {{argument: kind, values: [plain, lame]}}
seeds: 2
metrics:
  - value: optimised.py:value
  - loss: optimised.py:loss
  - speed_is: optimised.py:speed_is
optimise:
  objective: {objective}
  trials: {trials}
  batch: 4
  start: {{speed: 0.2, kind: lame}}
  fresh_seeds: 4
"""


def line(kind: str) -> Scene:
    """A belt; one that is lame is told by its description."""
    return parse_scene(LINE + f"description: {kind}\n")


def value(simulation: Simulation) -> float:
    """Best at 0.6 m/s, with a little that the seed adds to every point alike; a lame one is worse."""
    lame = 0.1 if simulation.scene.description == "lame" else 0.0
    return 1.0 - (speed_is(simulation) - 0.6) ** 2 - lame + 0.01 * random.Random(simulation.scene.seed).random()


def loss(simulation: Simulation) -> float:
    """Least at 0.3 m/s: a second goal that is against the first."""
    return (speed_is(simulation) - 0.3) ** 2


def speed_is(simulation: Simulation) -> float:
    """m/s"""
    return simulation.scene.belts["belt"].speed
