# SPDX-License-Identifier: Apache-2.0
"""Effects that only observe: they change no result, but cost time in every step or output."""

from collections.abc import Callable, Collection

from conveyor_sim.physics.effects.declaration import Cause, Effect
from conveyor_sim.physics.plant import Plant


def _output(name: str, *limits: str) -> Callable[[Plant, Collection[str]], Cause | None]:
    """Return the check for an effect that an output or any of `limits` enables."""

    def called_for(plant: Plant, on: Collection[str]) -> Cause | None:
        for field in limits:
            if (limit := getattr(plant.scene.limits, field)) is not None:
                return Cause(("limits", field), f"{limit:g}")
        rate = getattr(plant.scene.outputs, name)
        return Cause(("outputs", name), f"{rate:g} Hz") if rate > 0.0 else None

    return called_for


def _tipping(plant: Plant, on: Collection[str]) -> Cause | None:
    known = any(kind.contact_height is not None for kind in plant.scene.bottle_types.values())
    return _output("damage", "tipping")(plant, on) if known else None


PEAKS = Effect(
    name="peaks",
    law="largest contact force and impulse of each bottle, over every step",
    source="added",
    called_for=_output("bottles"),
    absent="outputs.bottles is 0",
    needs="two sums per bottle, normal force of each pair",
    can_force_on=True,
)
CONTACT_ARRAYS = Effect(
    name="contact_arrays",
    law="every contact with its forces, as columns",
    source="added",
    called_for=_output("contacts"),
    absent="outputs.contacts is 0",
    needs="columns of contacts, when they are output",
    can_force_on=True,
)
ENERGY_LEDGER = Effect(
    name="energy_ledger",
    law="balance of energy: the work of every belt, F u + M Omega, against the energy that friction and damping "
    "dissipate, that springs and motion store, and that bottles bring in and carry away. The residual is the error of "
    "the integrator",
    source="added",
    called_for=_output("ledger"),
    absent="outputs.ledger is 0",
    needs="damping and friction of each pair and each bottle, sums over all bottles in every step",
    can_force_on=True,
)
SCUFFING = Effect(
    name="scuffing",
    law="sliding work at a bottle's wall: sum of |T s| dt over its contacts and steps. Each bin of a rail has the same "
    "sum, and the impulse of its normal forces. A contact counts in full on both sides",
    source="added",
    called_for=_output("damage", "scuffing_work"),
    absent="outputs.damage is 0 and there is no limits.scuffing_work",
    needs="one sum per bottle, two per bin of a rail; a list of contacts in every step",
    can_force_on=True,
)
CRUSHING = Effect(
    name="crushing",
    law="largest sum of the normal forces on a bottle; largest squeeze between two normal forces that oppose each "
    "other, min(N_a, N_b) |cos|",
    source="added",
    called_for=_output("damage", "crushing_force", "opposed_force"),
    absent="outputs.damage is 0 and there is neither limits.crushing_force nor limits.opposed_force",
    needs="four peaks per bottle; a list of contacts in every step",
    can_force_on=True,
)
IMPACTS = Effect(
    name="impacts",
    law="largest relative normal speed one step before a contact closed; largest normal force of one contact",
    source="added",
    called_for=_output("damage", "impact_speed", "impact_force"),
    absent="outputs.damage is 0 and there is neither limits.impact_speed nor limits.impact_force",
    needs="contacts and velocity of each bottle in the previous step; a list of contacts in every step",
    can_force_on=True,
)
TIPPING = Effect(
    name="tipping",
    law="|F_c (h_c - h_cg) - F_b h_cg| / (m g R_b), with the moment smoothed over sqrt(h_cg/g). At 1, a lasting load "
    "tips the bottle. F_c is the sum of contact forces at height h_c, F_b the force under the base, and h_cg the "
    "height of the centre of gravity. R_b is base_radius, or radius for a bottle on a point",
    source="added",
    called_for=_tipping,
    absent="outputs.damage is 0 and there is no limits.tipping, or no type has contact_height and gravity_height",
    needs="one smoothed moment per bottle; a list of contacts, and the base friction, in every step",
)
