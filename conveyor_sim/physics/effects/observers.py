"""Effects that only observe: they add no law, but cost time in every step or output."""

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
    needs="two sums a bottle, normal forces by pair",
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
    law="work of every belt, F u + M Omega, against what friction and damping dissipate, what springs and motion hold, "
    "and what bottles bring and take; what is left over is the integrator's error",
    source="added",
    called_for=_output("ledger"),
    absent="outputs.ledger is 0",
    needs="damping and friction by pair and by bottle, sums over all bottles in every step",
    can_force_on=True,
)
SCUFFING = Effect(
    name="scuffing",
    law="sliding work at a bottle's wall, sum of |T s| dt over its contacts and the steps; the same, and the impulse "
    "of normal forces, for each bin of a rail. A contact counts in full for either side",
    source="added",
    called_for=_output("damage", "scuffing_work"),
    absent="outputs.damage is 0 and there is no limits.scuffing_work",
    needs="a sum a bottle, two a bin of rail, contacts listed anew in every step",
    can_force_on=True,
)
CRUSHING = Effect(
    name="crushing",
    law="largest sum of the normal forces on a bottle; largest squeeze by two of them that oppose each other, "
    "min(N_a, N_b) |cos|",
    source="added",
    called_for=_output("damage", "crushing_force", "opposed_force"),
    absent="outputs.damage is 0 and there is neither limits.crushing_force nor limits.opposed_force",
    needs="four peaks a bottle, contacts listed anew in every step",
    can_force_on=True,
)
IMPACTS = Effect(
    name="impacts",
    law="largest relative normal speed one step before a contact closed; largest normal force of one contact",
    source="added",
    called_for=_output("damage", "impact_speed", "impact_force"),
    absent="outputs.damage is 0 and there is neither limits.impact_speed nor limits.impact_force",
    needs="what each bottle touched a step before, and how fast it was then; contacts listed anew in every step",
    can_force_on=True,
)
TIPPING = Effect(
    name="tipping",
    law="|F_c (h_c - h_cg) - F_b h_cg| / (m g R_b), the moment smoothed over sqrt(h_cg/g): 1 for a load that would tip "
    "the bottle if it lasts. R_b is base_radius, or radius for a bottle on a point",
    source="added",
    called_for=_tipping,
    absent="outputs.damage is 0 and there is no limits.tipping, or no type has contact_height and gravity_height",
    needs="a smoothed moment a bottle; contacts and base friction found anew in every step",
)
