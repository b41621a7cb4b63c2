# SPDX-License-Identifier: Apache-2.0
"""Discs on a belt in a channel that narrows to an outlet: the set-up of the flow experiments.

The belt runs along x, the outlet is at x = 0. Walls at the hopper angle from a flat bottom (0 is flat) lead to it.
A slow belt drives the discs as in the experiments on belts. A belt so fast that every disc slips pulls with mu m g
against a disc of any velocity: this stands for gravity.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim import Simulation
from conveyor_sim.scene import Scene, parse_scene

DIAMETER = 0.011
"""m; the discs of Wang et al. It sets the scale of all set-ups."""
MASS = 2e-3
"""kg; except for the stiffness of contacts, all forces are proportional to it."""
GRAVITY = 9.81
TICK = 0.01
"""s"""
FAST = 20.0
"""m/s: a belt that stands for gravity; discs reach 1 m/s."""


@dataclass(frozen=True)
class Hopper:
    """Set-up of one run; lengths in disc diameters."""

    outlet: float
    angle: float
    """Degrees between the walls and a flat bottom."""
    discs: int
    width: float
    """Width of the channel."""
    speed: float
    """Belt speed, m/s."""
    seed: int
    friction: float = 0.3
    """Between discs, and at the walls."""
    base_friction: float = 0.4
    stiffness: float = 1e4
    """N/m."""
    springs: bool = False
    """Tangential springs at contacts instead of the friction curve alone."""
    flat: bool = True
    """Discs lie flat, so that the belt resists their spin; else they turn freely, as in a vertical cell."""
    slip_limit: float = 0.01
    """m/s."""
    pitch: float = 1.06
    """Spacing of the lattice that the discs start from."""
    jitter: float = 0.02
    """Largest displacement of a disc from its place in the lattice, along each axis."""
    steps: int = 250
    """Steps per tick of 10 ms. The preset would assume that all discs press on one contact, and take 40 times more."""

    @property
    def depth(self) -> float:
        """Length of the walls along the flow, in diameters."""
        return 0.5 * (self.width - self.outlet) * math.tan(math.radians(self.angle))


def places(hopper: Hopper) -> NDArray[np.float64]:
    """Return the positions of the discs (discs, 2), m: a triangular lattice of random orientation and offset.

    Each disc is moved at random by up to `jitter`. The packing closes as it moves. Discs nearest to the outlet come
    first.
    """
    random = np.random.default_rng(hopper.seed)
    turn = random.uniform(0.0, math.pi / 3.0)
    room = hopper.pitch**2 * hopper.discs / hopper.width
    reach = math.ceil(2.0 * room + 2.0 * hopper.width + hopper.depth)
    i, j = np.meshgrid(np.arange(-2 * reach, 2 * reach), np.arange(-2 * reach, 2 * reach))
    lattice = hopper.pitch * np.stack([i + 0.5 * j, 0.5 * math.sqrt(3.0) * j], axis=-1).reshape(-1, 2)
    c, s = math.cos(turn), math.sin(turn)
    lattice = (lattice + random.uniform(0.0, 1.0, 2)) @ np.array([[c, s], [-s, c]])
    inside = lattice[_room(hopper, lattice) > 0.51 + hopper.jitter]
    nearest = inside[np.argsort(-inside[:, 0], kind="stable")][: hopper.discs]
    return (nearest + random.uniform(-hopper.jitter, hopper.jitter, nearest.shape)) * DIAMETER


def _room(hopper: Hopper, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance of points (n, 2) from the nearest wall, negative outside; the outlet counts as a wall."""
    x, y = points[:, 0], np.abs(points[:, 1])
    angle = math.radians(hopper.angle)
    slope = -x * math.cos(angle) - (y - 0.5 * hopper.outlet) * math.sin(angle)
    return np.minimum(np.minimum(0.5 * hopper.width - y, slope), -x)


def scene(hopper: Hopper) -> Scene:
    """Build the scene; discs are removed two diameters behind the outlet."""
    d = DIAMETER
    wide, narrow, deep = 0.5 * hopper.width * d, 0.5 * hopper.outlet * d, hopper.depth * d
    discs = places(hopper)
    back = float(discs[:, 0].min()) - 2.0 * d
    contact = {"stiffness": hopper.stiffness, "damping": {"law": "normal", "restitution": 0.3}}
    tangential = {"tangential": {"stiffness": 0.8 * hopper.stiffness, "damping": 1.0}} if hopper.springs else {}
    surfaces = [{"between": ["disc", other], **contact, "friction": hopper.friction, **tangential}
                for other in ("disc", "wall")]  # fmt: skip
    kind = {"radius": 0.5 * d, "mass": MASS, "material": "disc", "inertia": 0.125 * MASS * d * d}
    # A uniform disc that spins on the spot is held by 2/3 mu m g R: so is a ring of 2/3 R.
    flat = {"base_radius": d / 3.0} if hopper.flat else {}
    return parse_scene(json.dumps({
        "name": "hopper", "tick": TICK, "duration": 10_000.0,
        "accuracy": {"per_tick": hopper.steps}, "slip_limit": hopper.slip_limit,
        "outputs": dict.fromkeys(("bottles", "poses", "contacts", "belts", "signals"), 0),
        "bottle_types": {"disc": {**kind, **flat}},
        "contacts": surfaces,
        "base": [{"between": ["disc", "belt"], "friction": hopper.base_friction}],
        "belts": {"belt": {"kind": "straight", "start": [back - 1.0, -wide - 0.5], "angle": 0.0, "length": 2.0 - back,
                           "width": 2.0 * wide + 1.0, "speed": hopper.speed, "speed_limits": [0.0, FAST],
                           "material": "belt"}},
        "rails": {
            name: {"kind": "polyline", "material": "wall", "points": _wall(back, wide, narrow, deep, side)}
            for name, side in (("left", 1), ("right", -1))
        },
        "outfeeds": {"end": {"region": [[2.0 * d, -wide], [0.9, -wide], [0.9, wide], [2.0 * d, wide]]}},
        "bottles": [{"type": "disc", "position": [float(x), float(y)]} for x, y in discs],
    }))  # fmt: skip


def _wall(back: float, wide: float, narrow: float, deep: float, side: int) -> list[list[float]]:
    """Return the wall at one side, in the order that has the channel on the same hand."""
    points = [[back, side * wide], [-deep, side * wide], [0.0, side * narrow]]
    return points[::side]


@dataclass(frozen=True)
class Discharge:
    """Course of one run."""

    times: NDArray[np.float64]
    """Time at which each disc left (n,), s."""
    here: NDArray[np.float64]
    """Discs in the outlet, |x| < d and |y| < D/2, at the end of each tick (ticks,)."""
    speed: NDArray[np.float64]
    """Their mean velocity along the belt (ticks,), m/s; NaN without discs."""

    def rate(self, first: int, last: int) -> float:
        """Return the discs per second between two counts of discs; NaN if fewer left."""
        if len(self.times) < last:
            return math.nan
        return (last - first) / float(self.times[last - 1] - self.times[first - 1])

    def in_outlet(self, first: int, last: int) -> tuple[float, float]:
        """Return number and mean velocity (m/s) of the discs in the outlet, between two counts of discs that left."""
        ticks = slice(round(self.times[first - 1] / TICK), round(self.times[last - 1] / TICK))
        return float(np.mean(self.here[ticks])), float(np.nanmean(self.speed[ticks]))


def discharge(hopper: Hopper, until: int, still: float, watch: bool = False) -> Discharge:
    """Return the course of a run that ends after `until` discs, or if none has left for `still` s: a jam.

    The first disc has twice that time. `watch`: also observe the discs in the outlet.
    """
    sim = Simulation(scene(hopper), threads=1)
    times: list[float] = []
    here: list[float] = []
    speed: list[float] = []
    last = still
    while len(times) < until and sim.time - last < still:
        sim.advance()
        new = sim.counts.removed - len(times)
        # The instant within the tick is unknown; discs of one tick are spread over it.
        times += [sim.time - TICK * (new - 0.5 - k) / new for k in range(new)]
        if new:
            last = sim.time
        if watch:
            bottles = sim.bottles()
            inside = (np.abs(bottles.x) < DIAMETER) & (np.abs(bottles.y) < 0.5 * hopper.outlet * DIAMETER)
            here.append(float(inside.sum()))
            speed.append(float(bottles.vx[inside].mean()) if inside.any() else math.nan)
    return Discharge(np.array(times[:until]), np.array(here), np.array(speed))
