# SPDX-License-Identifier: Apache-2.0
"""A scene with its bottles replaced by 64 bottles or pairs beside the plant: its own laws, in cases with closed forms.

Laws and coefficients are the scene's own, and so is the compiled kernel: all that it needs is there already.
"""

import math
from typing import Any

import numpy as np

from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.accuracy.trajectory import variant
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.scene import Scene, rail_shapes, surface_shapes
from conveyor_sim.simulation import Simulation

PHASES = 64
"""Bottles or pairs, each of which enters at another phase of a step."""

RAIL = "beside_the_plant"
"""Name of the rail that is put there."""

FIXED = 1e9
"""m/s, error of a step for methods that choose theirs: so large that they take the longest one, the given."""


def phases(root: float = 5.0) -> F8:
    """Points spread evenly over [0, 1) at every scale, (PHASES,): multiples of (sqrt(root) - 1) / 2, the golden ratio.

    Another root gives points that are independent of them.
    """
    return np.asarray(np.mod(np.arange(PHASES) * (math.sqrt(root) - 1.0) / 2.0, 1.0))


def corner(scene: Scene) -> tuple[float, float]:
    """Return a point (m) to the upper right of all surfaces and rails, at least two of the largest diameters away."""
    points = [np.zeros((1, 2)), *(shape.outline() for shape in surface_shapes(scene))]
    points += [np.array(piece.box) for rail in rail_shapes(scene) for piece in rail.pieces]
    x, y = np.vstack(points).max(axis=0)
    clear = 4.0 * max(kind.radius for kind in scene.bottle_types.values())
    return float(x) + clear, float(y) + clear


def pitch(scene: Scene) -> float:
    """Distance (m) between the bottles of a row before they are put in place, and between rows."""
    return 4.0 * max(kind.radius for kind in scene.bottle_types.values())


def simulation_aside(
    scene: Scene, types: tuple[str, ...], integrator: str, tick: float, steps: int, **fields: Any
) -> Simulation:
    """PHASES rows of bottles at rest, one of each type a row, on nothing; to be put in place with `displace`.

    Ids count the rows of the first type, then those of the second. The axis of the first is at `corner`, rows are a
    `pitch` apart along y, a row's bottles along x. Steps a tick of `tick` s.
    """
    x, y = corner(scene)
    apart = pitch(scene)
    grids = [
        {"grid": {"type": kind, "origin": [x + index * apart, y], "rows": PHASES, "columns": 1, "pitch": apart}}
        for index, kind in enumerate(types)
    ]
    supply = {name: "off" for name, there in (("infeed", scene.givers()), ("outfeed", scene.exits())) if any(there)}
    error = FIXED if integrator == "dormand_prince" else None
    placed = {"tick": tick, "duration": tick, "bottles": grids, "floor": "none", "lever_arm": "radius", **fields}
    return variant(scene, Setting(integrator, steps, error=error), effects=supply, **placed)


def rms(values: F8) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))
