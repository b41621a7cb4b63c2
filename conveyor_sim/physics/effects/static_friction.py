# SPDX-License-Identifier: Apache-2.0
"""Effect of static friction with memory under the bottles: a spring between base and belt."""

from collections.abc import Collection

from conveyor_sim.engine.contact.laws.linear import contact_time
from conveyor_sim.physics.effects.base import MEETING
from conveyor_sim.physics.effects.declaration import Cause, Effect
from conveyor_sim.physics.effects.terms import Meeting, Terms, drag_bound, tightest
from conveyor_sim.physics.laws.coefficients import base_springs
from conveyor_sim.physics.plant import Plant
from conveyor_sim.physics.timestep.bounds import Bound, damping_bound
from conveyor_sim.physics.timestep.methods import Share


def _springs(plant: Plant, on: Collection[str]) -> Cause | None:
    springs = base_springs(plant.scene)
    if "base_friction" not in on or springs is None:
        return None
    bottles = {kind.material for kind in plant.scene.bottle_types.values()}
    surfaces = {shape.material for shape in plant.surfaces}
    for index, base in enumerate(plant.scene.base):
        if base.tangential is not None and base.between[0] in bottles and base.between[1] in surfaces:
            return Cause(("base", index, "tangential"), f"{base.tangential.stiffness:g} N/m")
    return None


def _bounds(terms: Terms) -> list[Bound]:
    table = terms.laws.base_spring
    if table is None:
        return []
    springs, dashpots = [], []
    largest = (table.stiffness.max(axis=0).tolist(), table.damping.max(axis=0).tolist())
    for kind, k, c in zip(terms.types, *largest, strict=True):
        if k > 0.0:
            reason = f"{terms.steps:.3g} steps in pi sqrt(m / k) at k = {k:g} N/m"
            springs.append((contact_time(k, kind.mass) / terms.steps, reason))
        if c > 0.0:
            dashpots.append(drag_bound(terms, damping_bound(c, kind.mass), f"m / (2 c) at c = {c:g} kg/s"))
    return [*tightest("base spring", springs), *tightest("base spring damping", dashpots, stability=True)]


def _braked(meeting: Meeting, terms: Terms) -> list[Share]:
    """Return the error of first-order methods: braking in half a step, as with the friction curve."""
    table = terms.laws.base_spring
    if table is None or terms.method.second_order:
        return []
    braking = float(table.friction.max()) * terms.scene.gravity
    return [Share("braking by the base's spring", 1.0, 2.0 * MEETING * terms.plant.impact_speed / braking, 1.0)]


STATIC_FRICTION = Effect(
    name="static_friction",
    law="in place of the curve of base_friction, a spring and dashpot from the base to a point of its belt, k e + c v, "
    "with a force of at most mu m g. The point moves and turns with the belt, and a base that slides drags it along. "
    "On another belt a new spring starts at e = 0. The spring is explicit with every friction_solver, and applies to "
    "bottles on points only",
    source="Cundall and Strack 1979",
    called_for=_springs,
    absent="no base with tangential, or no friction under the bottles",
    needs="a point of its belt for each bottle; k, c and mu by belt and bottle type; in the scene, leapfrog, "
    "semi_implicit_euler or velocity_verlet as integrator",
    bounds=_bounds,
    bound="pi sqrt(m / k) divided by 2 / sqrt(tolerance), that is by 20 at 1 %; and m / (2 c)",
    shares=_braked,
    share="that of base_friction",
)
