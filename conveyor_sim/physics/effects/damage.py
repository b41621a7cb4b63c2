"""What bottles bear: scuffing, crushing, impacts and tipping. No law, but each is looked at in every step."""

from collections.abc import Callable, Collection

from conveyor_sim.physics.effects.declaration import Cause, Effect
from conveyor_sim.scene.schema import Scene


def _asked(*limits: str) -> Callable[[Scene, Collection[str]], Cause | None]:
    """Called for by the output, or by one of some limits."""

    def called_for(scene: Scene, on: Collection[str]) -> Cause | None:
        for name in limits:
            if (limit := getattr(scene.limits, name)) is not None:
                return Cause(("limits", name), f"{limit:g}")
        rate = scene.outputs.damage
        return Cause(("outputs", "damage"), f"{rate:g} Hz") if rate > 0.0 else None

    return called_for


def _tipping(scene: Scene, on: Collection[str]) -> Cause | None:
    known = any(kind.contact_height is not None for kind in scene.bottle_types.values())
    return _asked("tipping")(scene, on) if known else None


SCUFFING = Effect(
    name="scuffing",
    law="sliding work at a bottle's wall, sum of |T s| dt over its contacts and the steps; the same, and the impulse "
    "of normal forces, for each bin of a rail. A contact counts in full for either side",
    source="added",
    called_for=_asked("scuffing_work"),
    absent="outputs.damage is 0 and there is no limits.scuffing_work",
    needs="a sum a bottle, two a bin of rail, contacts listed anew in every step",
    can_force_on=True,
)
CRUSHING = Effect(
    name="crushing",
    law="largest sum of the normal forces on a bottle; largest squeeze by two of them that oppose each other, "
    "min(N_a, N_b) |cos|",
    source="added",
    called_for=_asked("crushing_force", "opposed_force"),
    absent="outputs.damage is 0 and there is neither limits.crushing_force nor limits.opposed_force",
    needs="four peaks a bottle, contacts listed anew in every step",
    can_force_on=True,
)
IMPACTS = Effect(
    name="impacts",
    law="largest relative normal speed one step before a contact closed; largest normal force of one contact",
    source="added",
    called_for=_asked("impact_speed", "impact_force"),
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
