"""Gates, pushers and diverters that can't be, or that can't be computed with what else a scene asks for."""

import math
from collections.abc import Iterator

from conveyor_sim.scene.geometry import TOUCH
from conveyor_sim.scene.movers import Diverter, SwingingGate
from conveyor_sim.scene.moving import movers_of, moving_shape
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.words import listed, shown

INTEGRATORS = ("leapfrog", "semi_implicit_euler", "velocity_verlet")
"""Those that move rails: the others take forces within a step, or solve for what a rail at rest exerts."""


def mover_problems(scene: Scene) -> list[Problem]:
    """Problems of the rails that move."""
    return [*_shapes(scene), *_drives(scene), *_integrator(scene)]


def unsound_movers(scene: Scene) -> set[Path]:
    """Paths of the movers whose geometry can't be."""
    return {problem.path[:2] for problem in _shapes(scene)}


def _shapes(scene: Scene) -> Iterator[Problem]:
    for path, mover in movers_of(scene):
        if math.dist(mover.from_, mover.to) <= TOUCH:
            yield Problem((*path, "to"), f"{shown(mover.to)} given, expected a point away from `from` (zero length)")
        if isinstance(mover, (SwingingGate, Diverter)) and not 1e-6 <= abs(mover.angle) <= 2.0 * math.pi:
            yield Problem(
                (*path, "angle"),
                f"{shown(mover.angle)} given, expected an angle of 1e-6 rad up to a full turn, to either side",
            )


def _drives(scene: Scene) -> Iterator[Problem]:
    unsound = unsound_movers(scene)
    for path, mover in movers_of(scene):
        shape = moving_shape(path, mover)
        if path in unsound or shape.limit is None or shape.acceleration * shape.mass <= shape.limit:
            continue
        limit, mass, force, inertia, unit = "force_limit", "moving_mass", "N", "kg", "m/s^2"
        if shape.turning:
            limit, mass, force, inertia, unit = "torque_limit", "inertia", "N m", "kg m^2", "rad/s^2"
        yield Problem(
            (*path, "acceleration"),
            f"{shown(shape.acceleration)} given, expected at most {shape.limit / shape.mass:.4g} ({unit}), what a "
            f"{limit} of {shape.limit:g} {force} gives to its {mass} of {shape.mass:.4g} {inertia}, or {limit}: none",
        )


def _integrator(scene: Scene) -> Iterator[Problem]:
    chosen = scene.accuracy.integrator
    for path, _ in movers_of(scene):
        if chosen not in INTEGRATORS:
            yield Problem(
                ("accuracy", "integrator"),
                f"{shown(chosen)} given, expected {listed(list(INTEGRATORS))}, as {path[0]}.{path[1]} moves: "
                "the other integrators take rails to be at rest within a step",
            )
            return
