"""Commands to moving rails in a study: every gate, pusher and diverter moves back and forth, one after the other.

A scene has no controller. Without commands its moving rails would stand still in all comparisons.
"""

from __future__ import annotations

import math

from conveyor_sim.line.devices.mover import WORDS
from conveyor_sim.scene import Scene
from conveyor_sim.scene.moving import moving_shapes
from conveyor_sim.simulation import Simulation

HALF = 2.0
"""s from one command of a mover to the next, or less in a short scene."""

LEAST_HALVES = 6
"""Commands of each mover in the scene's duration, at least."""


class Exercise:
    """Sends every moving rail of a scene to and fro. A run with it depends on the scene alone."""

    def __init__(self, scene: Scene) -> None:
        self._half = max(1, round(min(HALF, scene.duration / LEAST_HALVES) / scene.tick))
        """Ticks between two commands of one mover."""
        self._movers = [
            (f"{shape.name}/{WORDS[shape.name.split('/')[0]][0]}", shape.first != 0.0) for shape in moving_shapes(scene)
        ]
        """The command of each, and whether it is at the far end of its stroke at the start."""

    def __bool__(self) -> bool:
        """Return True if the scene has moving parts."""
        return bool(self._movers)

    def command(self, simulation: Simulation) -> None:
        """Queue what is due at this tick; to be called before every `advance`."""
        for index, (name, away) in enumerate(self._movers):
            # They take turns.
            since = simulation.tick - self._half // 2 - math.floor(self._half * index / len(self._movers))
            if since >= 0 and since % self._half == 0:
                on = (since // self._half) % 2 == 0
                simulation.command([name], [float(on != away)], "exercise")
