# SPDX-License-Identifier: Apache-2.0
"""Lines with an infeed screw or a star wheel, for tests."""

import math
from typing import Any

from scenes import NO_OUTPUTS, scene

from conveyor_sim.simulation import Simulation

RATE = 24000.0 / 3600.0
"""Bottles per second."""
RADIUS, MASS, STIFFNESS, MU = 0.033, 0.5, 2e4, 0.15
DAMPING = {"law": "normal", "restitution": 0.5}
FIRST_PITCH, LAST_PITCH = 0.068, 0.157
SCREW_START, SCREW_END = 1.0, 1.6
POCKETS, PITCH_RADIUS, POCKET_RADIUS = 12, 0.3, 0.034
SPEED = RATE / POCKETS * 2.0 * math.pi * PITCH_RADIUS
"""Speed of bottles in pockets, m/s."""
FAST = 1.3
"""Speed of a belt that is faster than all bottles in the screw, m/s."""

_STEEL = {"material": "steel"}
_SPARE = {
    "spare_arc": {"kind": "arc", "centre": [20.0, 20.0], "radius": 0.1, "start_angle": 0.0, "span": 1.0},
    "spare_segment": {"kind": "segment", "from": [20.0, 21.0], "to": [21.0, 21.0]},
}
"""Rails that no bottle touches."""


def line(damped: bool = True, friction: float = MU, threads: int = 1, **fields: Any) -> Simulation:
    """Return a line with two axes, and bottles of half a litre. damped, friction: at steel."""
    usual = {"stiffness": STIFFNESS, "friction": MU, "damping": DAMPING}
    contact = {"stiffness": STIFFNESS, "friction": friction, **({"damping": DAMPING} if damped else {})}
    given: dict[str, Any] = {
        "bottle_types": {"bottle": {"radius": RADIUS, "mass": MASS, "material": "pet"}},
        "contacts": [
            {"between": ["pet", "pet"], **usual},
            {"between": ["pet", "steel"], **contact},
            {"between": ["pet", "brass"], **usual},
        ],
        "base": [{"between": ["pet", "chain"], "friction": MU}],
        "axes": {"block": {"rate": RATE}, "star": {"master": "block", "ratio": 1.0 / POCKETS}},
        "accuracy": {"per_tick": 100},
        "effects": {"peaks": "on"},
        "outputs": NO_OUTPUTS,
        "duration": 100.0,
    }
    return Simulation(scene(**{**given, **fields}), threads)


def screw_line(speed: float, threads: int = 1, play: float = 1e-3, **fields: Any) -> Simulation:
    """Return a conveyor with a queue of bottles in front of a screw. play: of bottles to each side, m."""
    guides = {**_STEEL, "clearance": 2.0 * (RADIUS + play)}
    return line(
        threads=threads,
        conveyors={
            "infeed": {"start": [0.0, 0.0], "path": [{"straight": 3.0}], "width": 0.1, "speed": speed,
                       "material": "chain", "guides": guides},
        },
        screws={
            "in": {"along": "infeed", "from": SCREW_START, "to": SCREW_END, "side": "left", "axis": "block",
                   "pitch": [[0.0, FIRST_PITCH], [SCREW_END - SCREW_START, LAST_PITCH]],
                   "pocket_radius": RADIUS + play, **_STEEL},
        },
        infeeds={"filler": {"along": "infeed", "at": 0.05, "bottle": "bottle", "rate": 8.0}},
        outfeeds={"packer": {"along": "infeed", "at": "end", "length": 0.1}},
        **fields,
    )  # fmt: skip


def star_line(late: float = 0.0, guided: bool = True, worn: float = 0.0, **fields: Any) -> Simulation:
    """Return a bottle that comes to a wheel at the speed of its pockets, and one at rest far away.

    late: of the wheel, in pitches. worn: by which its first pocket is larger, m. The second bottle and the spare rails
    give all wheels the kernels of a line with guides and a queue.
    """
    before = 0.5
    star = {
        "along": "infeed", "at": 1.0, "side": "left", "pockets": POCKETS, "pitch_radius": PITCH_RADIUS,
        "pocket_radius": POCKET_RADIUS, "axis": "star", "worn": worn, **_STEEL,
        "phase": before / PITCH_RADIUS + late * 2.0 * math.pi / POCKETS,
    }  # fmt: skip
    if guided:
        star["guide"] = _STEEL
    conveyors = {
        "infeed": {"start": [0.0, 0.0], "path": [{"straight": 1.2}], "width": 0.1, "speed": SPEED,
                   "material": "chain"},
        "discharge": {"start": [1.0, 2.0 * PITCH_RADIUS], "heading": math.pi, "path": [{"straight": 1.0}],
                      "width": 0.1, "speed": SPEED, "material": "chain"},
    }  # fmt: skip
    if guided:
        sides = {"left": [[0.0, POCKET_RADIUS]], "right": [[0.0, -POCKET_RADIUS]]}
        conveyors["infeed"]["guides"] = {**_STEEL, **sides, "to": 1.0}
        stripper = {"right": sides["right"], "left": [[0.05, POCKET_RADIUS + 0.002], [0.2, POCKET_RADIUS]]}
        conveyors["discharge"]["guides"] = {**_STEEL, **stripper}
    bottle = {"type": "bottle", "position": [1.0 - before, 0.0], "velocity": [SPEED, 0.0]}
    far = {"type": "bottle", "position": [20.0, 18.0]}
    return line(
        conveyors=conveyors, stars={"in": star}, bottles=[bottle, far],
        rails={name: {**rail, "material": "brass"} for name, rail in _SPARE.items()}, **fields,
    )  # fmt: skip
