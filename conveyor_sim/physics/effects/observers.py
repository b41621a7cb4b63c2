"""What is only looked at: no law, but it costs time."""

from collections.abc import Collection

from conveyor_sim.physics.effects.declaration import Cause, Effect
from conveyor_sim.scene.schema import Scene


def _peaks(scene: Scene, on: Collection[str]) -> Cause | None:
    rate = scene.outputs.bottles
    return Cause(("outputs", "bottles"), f"{rate:g} Hz") if rate > 0.0 else None


def _contact_arrays(scene: Scene, on: Collection[str]) -> Cause | None:
    rate = scene.outputs.contacts
    return Cause(("outputs", "contacts"), f"{rate:g} Hz") if rate > 0.0 else None


def _energy_ledger(scene: Scene, on: Collection[str]) -> Cause | None:
    rate = scene.outputs.ledger
    return Cause(("outputs", "ledger"), f"{rate:g} Hz") if rate > 0.0 else None


PEAKS = Effect(
    name="peaks",
    law="largest contact force and impulse of each bottle, over every step",
    source="added",
    called_for=_peaks,
    absent="outputs.bottles is 0",
    needs="two sums a bottle, normal forces by pair",
    can_force_on=True,
)
CONTACT_ARRAYS = Effect(
    name="contact_arrays",
    law="every contact with its forces, as columns",
    source="added",
    called_for=_contact_arrays,
    absent="outputs.contacts is 0",
    needs="columns of contacts, when they are output",
    can_force_on=True,
)
ENERGY_LEDGER = Effect(
    name="energy_ledger",
    law="work of every belt, F u + M Omega, against what friction and damping dissipate, what springs and motion hold, "
    "and what bottles bring and take; what is left over is the integrator's error",
    source="added",
    called_for=_energy_ledger,
    absent="outputs.ledger is 0",
    needs="damping and friction by pair and by bottle, sums over all bottles in every step",
    can_force_on=True,
)
