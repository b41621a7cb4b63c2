"""Effects of what bottles stand on: friction, belts, and the ring that a base is."""

from collections.abc import Collection

from conveyor_sim.effects.declaration import Cause, Effect
from conveyor_sim.effects.terms import Terms, tightest
from conveyor_sim.laws import base_friction
from conveyor_sim.scene.belts import CurvedBelt
from conveyor_sim.scene.schema import Scene
from conveyor_sim.timestep import STEPS_PER_SLIP, Bound, base_friction_bound


def _friction(scene: Scene, on: Collection[str]) -> Cause | None:
    table = base_friction(scene)
    if scene.gravity == 0.0 or not table.any():
        return None
    for row, name in enumerate(scene.belts):
        if table[row].any():
            return Cause(("belts", name), f"friction {table[row].max():g}")
    return Cause(("floor",), f"friction {table[-1].max():g}")


def _friction_bounds(terms: Terms) -> list[Bound]:
    if terms.laws.base_friction is None or _implicit_point(terms):
        return []
    mu = float(terms.laws.base_friction.max())
    dt = base_friction_bound(mu, terms.scene.gravity, terms.scene.slip_limit)
    return [Bound("base friction", dt, f"{STEPS_PER_SLIP} steps in v_lim / (mu g) at mu = {mu:g}")]


def _implicit_point(terms: Terms) -> bool:
    """Whether friction under bottles is solved implicitly: that of a point is, that of a ring has no closed form."""
    return "implicit_friction" in terms.on and "ring_base" not in terms.on


def _ring(scene: Scene, on: Collection[str]) -> Cause | None:
    # Rotation is decided later, for a ring calls for it; where it is forced off, the ring has nothing to turn.
    if "base_friction" in on and scene.effects.get("rotation") != "off":
        for name, kind in scene.bottle_types.items():
            if kind.base_radius is not None:
                return Cause(("bottle_types", name, "base_radius"), f"{kind.base_radius:g} m")
    return None


def _ring_bounds(terms: Terms) -> list[Bound]:
    """The slope of the spinning ring's moment at rest is that of the sliding point's force, for J / (m R_b^2)."""
    if terms.laws.base_friction is None:
        return []
    mu = float(terms.laws.base_friction.max())
    point = base_friction_bound(mu, terms.scene.gravity, terms.scene.slip_limit)
    candidates = []
    for kind in terms.types:
        if kind.base_radius is not None:
            dt = point * kind.moment_of_inertia / (kind.mass * kind.base_radius**2)
            reason = f"{STEPS_PER_SLIP} steps in v_lim J / (mu g m R_b^2) at mu = {mu:g}, R_b = {kind.base_radius:g} m"
            candidates.append((dt, reason))
    return tightest("spin on the base", candidates)


def _belts(scene: Scene, on: Collection[str]) -> Cause | None:
    return Cause(("belts", next(iter(scene.belts)))) if scene.belts and "base_friction" in on else None


def _curved_belts(scene: Scene, on: Collection[str]) -> Cause | None:
    for name, belt in scene.belts.items():
        if isinstance(belt, CurvedBelt) and "belts" in on:
            return Cause(("belts", name))
    return None


BASE_FRICTION = Effect(
    name="base_friction",
    law="mu m g p(s), at the axis",
    source="(7)-(10), (15)",
    called_for=_friction,
    absent="no friction under the bottles",
    needs="mu by belt and bottle type, velocity of each surface",
    bounds=_friction_bounds,
    bound="20 steps in v_lim / (mu g)",
)
RING_BASE = Effect(
    name="ring_base",
    law="the base is a ring: sliding and spinning share its friction, and it may straddle two belts; v / sqrt(v^2 + "
    "(v_lim / 2)^2) of each part of it drags in place of p(s); always explicit, whatever the friction_solver; types "
    "without base_radius beside it stand on points",
    source="added",
    called_for=_ring,
    absent="no bottle type with base_radius, no friction under the bottles, or rotation forced off",
    needs="base_radius by bottle type",
    bounds=_ring_bounds,
    bound="20 steps in v_lim J / (mu g m R_b^2), for the spin",
)
BELTS = Effect(
    name="belts",
    law="the last listed belt under the axis carries",
    source="(11)-(15)",
    called_for=_belts,
    absent="no belt with friction",
    needs="outlines of the belts, a grid over them, belts near each bottle",
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
