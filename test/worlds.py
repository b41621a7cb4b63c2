# SPDX-License-Identifier: Apache-2.0
"""The engine's arrays with bottles at any positions, overlapping ones included."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scenes import NO_FLOOR, RADIUS, bottle, contact, scene

from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import kernel
from conveyor_sim.engine.contact.path import reset_path
from conveyor_sim.engine.forces import bottle_forces, pack_all, pair_phase
from conveyor_sim.engine.integrators import INTEGRATORS, START
from conveyor_sim.engine.lists.riding import step_all
from conveyor_sim.engine.threads.thread_pool import ThreadPool
from conveyor_sim.engine.threads.workers import BLOCK, workers
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.state import State
from conveyor_sim.scene import Scene

F8 = NDArray[np.float64]

STIFFNESS = 1000.0
"""Stiffness of glass on steel in `rail_scene`, N/m."""

FAR = 90.0
"""m: a bottle at (FAR, FAR) has no neighbours."""

ALONE = workers(1)[0]
"""The only worker of a group of one."""


def callable_part(function: Any) -> Any:
    """Return a part of kernels as a kernel, to be called from Python."""
    return kernel(function.py_func)


def advance(integrator: str, world: World, steps: int, dt: float, phase: int = START) -> int:
    """Take steps of dt seconds in this thread; return how many were finished."""
    return ThreadPool(1).advance(1, INTEGRATORS[integrator], world, steps, dt, phase)


def evaluate(world: World, dt: float = 1e-5) -> None:
    """Evaluate all forces of the present state into `world.load`; springs stay as they are."""
    _evaluate(world, ALONE, dt)


@kernel
def _evaluate(world: World, worker: Worker, dt: float) -> None:
    reset_path(world.path, world.moving, worker)
    step_all(world.riding, world.bottles, worker)
    pack_all(world, worker)
    pair_phase(world, worker, dt, 0.0)
    bottles = world.bottles.x.size
    for first in range(0, bottles, BLOCK):
        bottle_forces(world, worker, dt, 0.0, first, min(first + BLOCK, bottles))


def state_of(
    scene: Scene, points: Any, velocities: Any = None, spins: Any = None, kinds: Any = None, lists: bool = True
) -> State:
    """Return a State with bottles at points (n, 2), in slots 0 to n - 1; those of the scene are removed."""
    points = np.asarray(points, float)
    velocities = np.zeros_like(points) if velocities is None else np.asarray(velocities, float)
    spins = np.zeros(len(points)) if spins is None else spins
    kinds = np.zeros(len(points), int) if kinds is None else kinds
    state = State(build_model(scene))
    for (x, y), (vx, vy), omega, kind in zip(points, velocities, spins, kinds, strict=True):
        state.add(int(kind), x, y, 0.0, vx, vy, float(omega))
    if lists:
        state.make_lists()
    return state


def rail_scene(rails: dict[str, Any], **fields: Any) -> Scene:
    """Return a scene of rails of STIFFNESS alone, with one bottle, so that bottles don't touch each other."""
    return scene(
        contacts=[contact(STIFFNESS, "steel")], rails=rails, bottles=[bottle(FAR, FAR)], **{**NO_FLOOR, **fields}
    )


def rail_forces(rails: dict[str, Any], points: Any) -> F8:
    """Return the force (n, 2), N, of the rails on bottles at rest at points (n, 2)."""
    points = np.asarray(points, float)
    state = state_of(rail_scene(rails), points)
    evaluate(state.world)
    return np.column_stack([state.world.load.fx, state.world.load.fy])[: len(points)]


def push(nearest: Any, points: Any, radius: float = RADIUS) -> F8:
    """Return k (R - d) away from the nearest point, (n, 2), the force of one contact; 0 beyond R."""
    away = np.asarray(points, float) - nearest
    distance = np.hypot(*away.T)
    return (STIFFNESS * np.maximum(radius - distance, 0.0) / distance)[:, None] * away


def nearest_on_segment(start: Any, end: Any, points: Any) -> F8:
    """Return the nearest point (n, 2) of a segment."""
    start, along = np.asarray(start, float), np.asarray(end, float) - np.asarray(start, float)
    share = np.clip((np.asarray(points) - start) @ along / (along @ along), 0.0, 1.0)
    return np.asarray(start + share[:, None] * along)


def nearest_on_arc(centre: Any, radius: float, start: float, span: float, points: Any) -> F8:
    """Return the nearest point (n, 2) of an arc."""
    centre = np.asarray(centre, float)
    seen = np.asarray(points) - centre
    angle = np.mod(np.arctan2(seen[:, 1], seen[:, 0]) - start, 2.0 * np.pi)
    ends = centre + radius * np.array([[np.cos(a), np.sin(a)] for a in (start, start + span)])
    to_ends = [np.hypot(*(points - end).T) for end in ends]
    end = np.where((to_ends[0] <= to_ends[1])[:, None], ends[0], ends[1])
    on_circle = centre + radius * seen / np.hypot(*seen.T)[:, None]
    return np.asarray(np.where((angle <= span)[:, None], on_circle, end))


def nearest_of(candidates: list[F8], points: Any) -> F8:
    """Return the nearest of several candidates (n, 2) each."""
    distance = np.array([np.hypot(*(np.asarray(points) - one).T) for one in candidates])
    return np.asarray(np.choose(np.argmin(distance, axis=0)[:, None], candidates))
