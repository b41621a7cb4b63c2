# SPDX-License-Identifier: Apache-2.0
"""Effects of the support under bottles: friction, belts, and ring-shaped bases."""

from collections.abc import Callable, Collection
from functools import partial

from conveyor_sim.physics.effects.declaration import Cause, Effect
from conveyor_sim.physics.effects.terms import Meeting, Terms, drag_bound, tightest
from conveyor_sim.physics.laws.coefficients import base_friction
from conveyor_sim.physics.plant import Plant
from conveyor_sim.physics.timestep.bounds import Bound, base_friction_bound, slip_time
from conveyor_sim.physics.timestep.methods import Share
from conveyor_sim.physics.timestep.prediction import Term
from conveyor_sim.scene.driven import belt_speeds

MEETING = 0.2
"""Ratio of the typical to the fastest speed at which bottles meet, measured on the scenes of docs/accuracy.md."""


def _friction(plant: Plant, on: Collection[str]) -> Cause | None:
    table = base_friction(plant.scene)
    if plant.scene.gravity == 0.0 or not table.any():
        return None
    for row, path in enumerate(plant.surface_paths):
        if table[row].any():
            return Cause(path, f"friction {table[row].max():g}")
    return Cause(("floor",), f"friction {table[-1].max():g}")


def _friction_bounds(terms: Terms) -> list[Bound]:
    if terms.laws.base_friction is None:
        return []
    mu, g, limit = float(terms.laws.base_friction.max()), terms.scene.gravity, terms.scene.slip_limit
    implicit, bounds = _implicit_point(terms), []
    if terms.method.explicit and not implicit:
        reason = f"half of v_lim / (mu g) at mu = {mu:g}"
        bounds.append(
            Bound("base friction", *drag_bound(terms, base_friction_bound(mu, g, limit), reason), stability=True)
        )
    # On a turning belt, the creep of a bottle has a relative error of 1 / steps with explicit friction.
    held = terms.method.held if implicit else terms.method.slip_steps(terms.tolerance)
    turning = held if "curved_belts" in terms.on else 0.0
    if (steps := max(0.0 if implicit else _slip_steps(terms), turning)) > 0.0:
        reason = f"{steps:.3g} steps in v_lim / (mu g) at mu = {mu:g}"
        bounds.append(Bound("base slip", slip_time(mu, g, limit) / steps, reason))
    return bounds


def _slip_steps(terms: Terms) -> float:
    """Return the steps per v_lim / (mu g) at which the relative error is 1 / `terms.steps`.

    First-order methods take `terms.steps`, second-order methods fewer (`Method.slip_steps`).
    """
    return terms.method.slip_steps(1.0 / terms.steps) if terms.method.second_order else terms.steps


def _lag(quantity: str, part: Callable[[float], float], terms: Terms, dt: float) -> list[Term]:
    """Return the error of a bottle that friction holds on its circle. part: error as a function of n.

    n is the number of steps per v_lim / (mu g).

    Semi-implicit Euler combines a belt velocity at the present position with a bottle velocity that is half a step
    older. Leapfrog takes the belt velocity at the mid-step position (test/physics/test_turntable.py).
    """
    if terms.laws.base_friction is None or "curved_belts" not in terms.on:
        return []
    mu = float(terms.laws.base_friction.max())
    steps = slip_time(mu, terms.scene.gravity, terms.scene.slip_limit) / dt
    off = part(steps)
    reason = f"{steps:.3g} steps in v_lim / (mu g) at mu = {mu:g}"
    return [Term(quantity, off, reason)] if off > 0.0 else []


def _creep(terms: Terms, dt: float) -> list[Term]:
    return _lag("creep on curved belts", _creep_off(terms, dt), terms, dt)


def _creep_off(terms: Terms, dt: float) -> Callable[[float], float]:
    """Return a function that returns the relative error of creep from the steps per v_lim / (mu g)."""
    if _implicit_point(terms):
        return partial(terms.method.implicit_creep_off, per_tick=terms.scene.tick / dt)
    return terms.method.creep_off


def _resting(terms: Terms, dt: float) -> list[Term]:
    """Return the errors of loads on turning belts.

    The force against the rim of a turntable is the part of m Omega^2 r that friction does not hold; it has the relative
    error of the creep. The lag is an outward slip of Omega^2 r dt / 2: a friction of m mu g Omega^2 r dt / v_lim.
    """
    # With explicit friction, semi-implicit Euler's error of the creep contains the lag.
    lags = _implicit_point(terms) or terms.method.creep == 0.0
    turns = terms.laws.base_friction is not None and "curved_belts" in terms.on and lags
    behind = terms.method.turned * _turning(terms.plant) * dt if turns else 0.0
    late = [Term("load on turning belts", behind, "half a step's turn of the belt")] if behind > 0.0 else []
    return [*_lag("load on turning belts", _creep_off(terms, dt), terms, dt), *late]


def _turning(plant: Plant) -> float:
    """Return the largest initial angular velocity of a curved belt, rad/s; 0 without curved belts."""
    speeds = list(belt_speeds(plant.scene).values())
    return max(
        (
            abs(speeds[shape.belt]) * shape.ratio / shape.centre_radius
            for shape in plant.surfaces
            if shape.kind == "curved" and shape.belt is not None
        ),
        default=0.0,
    )


def _braked(meeting: Meeting, terms: Terms) -> list[Share]:
    """Return the error of first-order methods: braking in half a step, mu g dt / 2, relative to the impact speed."""
    if terms.laws.base_friction is None or terms.method.second_order:
        return []
    braking = float(terms.laws.base_friction.max()) * terms.scene.gravity
    return [Share("braking by the base", 1.0, 2.0 * MEETING * terms.plant.impact_speed / braking, 1.0)]


def _implicit_point(terms: Terms) -> bool:
    """Return True if friction under bottles is implicit. It is explicit under rings, which have no closed form."""
    return "implicit_friction" in terms.on and "ring_base" not in terms.on


def _ring(plant: Plant, on: Collection[str]) -> Cause | None:
    # A ring enables rotation, which is decided later. Where rotation is forced off, the ring turns nothing.
    if "base_friction" in on and plant.scene.effects.get("rotation") != "off":
        for name, kind in plant.scene.bottle_types.items():
            if kind.base_radius is not None:
                return Cause(("bottle_types", name, "base_radius"), f"{kind.base_radius:g} m")
    return None


def _ring_bounds(terms: Terms) -> list[Bound]:
    """Return the bounds for the spin of a ring: the bounds for a sliding point times J / (m R_b^2)."""
    if terms.laws.base_friction is None:
        return []
    mu = float(terms.laws.base_friction.max())
    time, steps = slip_time(mu, terms.scene.gravity, terms.scene.slip_limit), _slip_steps(terms)
    stable, exact = [], []
    for kind in terms.types:
        if kind.base_radius is not None:
            spin = time * kind.moment_of_inertia / (kind.mass * kind.base_radius**2)
            reason = f"v_lim J / (mu g m R_b^2) at mu = {mu:g}, R_b = {kind.base_radius:g} m"
            if terms.method.explicit:
                stable.append(drag_bound(terms, 0.5 * spin, f"half of {reason}"))
            if steps > 0.0:
                exact.append((spin / steps, f"{steps:.3g} steps in {reason}"))
    return [*tightest("spin on the base", stable, stability=True), *tightest("base spin", exact)]


def _belts(plant: Plant, on: Collection[str]) -> Cause | None:
    return Cause(plant.surface_paths[0]) if plant.surfaces and "base_friction" in on else None


def _curved_belts(plant: Plant, on: Collection[str]) -> Cause | None:
    for shape, path in zip(plant.surfaces, plant.surface_paths, strict=True):
        if shape.kind == "curved" and shape.belt is not None and "belts" in on:
            return Cause(path)
    return None


BASE_FRICTION = Effect(
    name="base_friction",
    law="mu m g p(s), at the axis",
    source="(7)-(10), (15)",
    called_for=_friction,
    absent="no friction under the bottles",
    needs="mu by surface and bottle type, velocity of each surface",
    bounds=_friction_bounds,
    bound="half of tau = v_lim / (mu g). Leapfrog and semi-implicit Euler: also 2 / sqrt(tolerance) steps per tau, 20 "
    "at 1 %. Semi-implicit Euler with curved belts: also 1 / tolerance steps per tau, 100 at 1 %. Implicit friction "
    "has none of these bounds; velocity Verlet with curved belts takes at least one step per tau then. The linearly "
    "implicit method is stable in steps of any length; it takes at least 4 per tau",
    shares=_braked,
    share="with leapfrog and semi-implicit Euler mu g dt / (2 v). v is a fifth of the largest impact speed, because "
    "most impacts are slower",
    resting=_resting,
    rest="on curved belts 1 / n with semi-implicit Euler, where n is the number of steps per v_lim / (mu g); "
    "Omega dt / 2 with leapfrog; both as with leapfrog for implicit friction",
    side=_creep,
    beside="in the creep on curved belts 1 / n with semi-implicit Euler; none with implicit friction, but for velocity "
    "Verlet (1 - n) dt / (n tick) below n = 1; n as above",
)
RING_BASE = Effect(
    name="ring_base",
    law="the base is a ring: sliding and spinning share its friction, and it may straddle two belts. For each part of "
    "the ring, v / sqrt(v^2 + (v_lim / 2)^2) takes the place of p(s). Friction of rings is explicit with every "
    "friction_solver. Bottle types without base_radius in the same scene stand on points",
    source="added",
    called_for=_ring,
    absent="no bottle type has base_radius, there is no friction under the bottles, or rotation is forced off",
    needs="base_radius by bottle type",
    bounds=_ring_bounds,
    bound="for the spin, those of base_friction with tau = v_lim J / (mu g m R_b^2)",
)
BELTS = Effect(
    name="belts",
    law="where surfaces overlap, the last one in the list carries the bottle whose axis is on it; plates are listed "
    "after belts",
    source="(11)-(15)",
    called_for=_belts,
    absent="no belt or plate with friction",
    needs="outlines of the surfaces, a grid over them, surfaces near each bottle",
)
CURVED_BELTS = Effect(
    name="curved_belts",
    law="surface velocity Omega x (r - C)",
    source="Table 1",
    called_for=_curved_belts,
    absent="no curved belt with friction",
    needs="sectors of the belts, angular velocity and centre of each surface",
    can_force_off=False,
)
