# SPDX-License-Identifier: Apache-2.0
"""All effects in order, the choice of effects for a scene, and their bounds and predictions together."""

from collections.abc import Mapping, Sequence
from functools import partial

from conveyor_sim.engine.integrators import SWEPT
from conveyor_sim.errors import SceneError
from conveyor_sim.physics.effects.base import BASE_FRICTION, BELTS, CURVED_BELTS, RING_BASE
from conveyor_sim.physics.effects.bottles import INFEED, OUTFEED, RIDING, ROTATION, SLEEPING
from conveyor_sim.physics.effects.contacts import BOTTLE_CONTACT, HERTZ, LINEAR, TABLE
from conveyor_sim.physics.effects.damping import DAMPING_EFFECTS
from conveyor_sim.physics.effects.declaration import Effect, EffectChoice
from conveyor_sim.physics.effects.friction import ATAN_FRICTION, CONTACT_FRICTION, IMPLICIT_FRICTION, TANGENTIAL_SPRING
from conveyor_sim.physics.effects.geometry import ARC_RAILS, MOVING_RAILS, SEGMENT_RAILS, UNEQUAL_RADII
from conveyor_sim.physics.effects.impulses import impulse_bounds, impulse_prediction
from conveyor_sim.physics.effects.observers import (
    CONTACT_ARRAYS,
    CRUSHING,
    ENERGY_LEDGER,
    IMPACTS,
    PEAKS,
    SCUFFING,
    TIPPING,
)
from conveyor_sim.physics.effects.static_friction import STATIC_FRICTION
from conveyor_sim.physics.effects.terms import Meeting, Terms, deepest, duration, meetings, overlap_at
from conveyor_sim.physics.effects.vibration import VIBRATION
from conveyor_sim.physics.plant import Plant
from conveyor_sim.physics.timestep.bounds import Bound
from conveyor_sim.physics.timestep.prediction import Impact, Prediction, predict
from conveyor_sim.scene.effect_names import EffectName
from conveyor_sim.scene.places import Places
from conveyor_sim.scene.schema import Scene

EFFECTS: tuple[Effect, ...] = (
    BOTTLE_CONTACT,
    SEGMENT_RAILS,
    ARC_RAILS,
    MOVING_RAILS,
    UNEQUAL_RADII,
    LINEAR,
    HERTZ,
    TABLE,
    *DAMPING_EFFECTS,
    CONTACT_FRICTION,
    BASE_FRICTION,
    ATAN_FRICTION,
    IMPLICIT_FRICTION,
    TANGENTIAL_SPRING,
    STATIC_FRICTION,
    RING_BASE,
    BELTS,
    CURVED_BELTS,
    VIBRATION,
    ROTATION,
    INFEED,
    OUTFEED,
    PEAKS,
    CONTACT_ARRAYS,
    ENERGY_LEDGER,
    SCUFFING,
    CRUSHING,
    IMPACTS,
    TIPPING,
    RIDING,
    SLEEPING,
)
"""All effects in the order of decision. An effect that is on may enable later ones."""


def choose_effects(plant: Plant) -> tuple[EffectChoice, ...]:
    """Decide every effect for a plant, in the order of EFFECTS. Raise SceneError if one can't be forced."""
    choices: list[EffectChoice] = []
    refused: dict[EffectName, str] = {}
    on: set[str] = set()
    for effect in EFFECTS:
        choice = _choose(effect, plant, on)
        if choice is None:
            refused[effect.name] = _absent(effect, plant, on)
            continue
        choices.append(choice)
        if choice.on:
            on.add(effect.name)
    if refused:
        raise SceneError("\n".join(_refusals(plant.scene, refused)))
    return tuple(choices)


def impacts_of(terms: Terms) -> tuple[Impact, ...]:
    """Return one expected impact per pair of bottle types that can touch, and per bottle type and rail material.

    Each has the errors of all effects that are on.
    """
    adding = [effect.shares for effect in EFFECTS if effect.shares is not None and effect.name in terms.on]
    speed = terms.plant.impact_speed
    return tuple(
        Impact(
            what=meeting.what,
            at=_at(meeting, terms, speed),
            duration=duration(meeting, terms, speed),
            shares=tuple(share for shares in adding for share in shares(meeting, terms)),
            left=terms.method.own_error * terms.step_error / speed,
            force=deepest(meeting, terms, speed)[1],
            diameter=2.0 * min(kind.radius for kind in (meeting.first, meeting.second) if kind is not None),
            overlap=partial(overlap_at, meeting, terms),
        )
        for meeting in meetings(terms)
    )


def bounds_of(terms: Terms, expected: Sequence[Impact]) -> tuple[Bound, ...]:
    """Return the bounds on dt by effects and impacts, each the tightest over bottle types and materials."""
    if terms.scene.accuracy.integrator in SWEPT:
        return impulse_bounds(terms)
    by_effect = [effect.bounds(terms) for effect in EFFECTS if effect.bounds is not None and effect.name in terms.on]
    return (*_impact_bounds(expected, terms.tolerance), *(bound for bounds in by_effect for bound in bounds))


def prediction_of(terms: Terms, expected: Sequence[Impact], dt: float) -> Prediction:
    """Return the errors to expect at a time step in s."""
    if terms.scene.accuracy.integrator in SWEPT:
        return impulse_prediction(terms, expected, dt)
    on = [effect for effect in EFFECTS if effect.name in terms.on]
    sides = [term for effect in on if effect.side is not None for term in effect.side(terms, dt)]
    resting = [term for effect in on if effect.resting is not None for term in effect.resting(terms, dt)]
    return predict(expected, resting, sides, (terms.load.force, terms.load.reason), dt)


def _choose(effect: Effect, plant: Plant, on: set[str]) -> EffectChoice | None:
    """Return the choice; None if the scene forces the effect on or off where that is impossible."""
    cause = effect.called_for(plant, on)
    forced = plant.scene.effects.get(effect.name)
    if forced is None:
        why = _absent(effect, plant, on) if cause is None else str(cause)
        return EffectChoice(effect.name, cause is not None, why, None if cause is None else cause.path)
    possible = effect.can_force_off if forced == "off" else effect.can_force_on
    if not possible and (cause is not None) != (forced == "on"):
        return None
    why = f"forced {forced} by effects.{effect.name}" + (f"; {cause} enables it" if cause is not None else "")
    return EffectChoice(effect.name, forced == "on", why, ("effects", effect.name), forced=True)


def _absent(effect: Effect, plant: Plant, on: set[str]) -> str:
    here = "" if effect.absent_here is None else effect.absent_here(plant, on)
    return here or effect.absent


def _refusals(scene: Scene, absent: Mapping[EffectName, str]) -> list[str]:
    """Return a line per effect that can't be forced, in the order of the file. absent: reasons by name."""
    places = Places(scene)
    lines = []
    for name in sorted(absent, key=lambda name: places.line_of(("effects", name)) or 0):
        reason = f'"on" given, expected "off": {absent[name]}'
        if scene.effects[name] == "off":
            reason = '"off" given, expected "on": a field of the scene needs this effect'
        lines.append(f"{places.of(('effects', name))}: effects.{name}: {reason}")
    return lines


def _impact_bounds(expected: Sequence[Impact], tolerance: float) -> list[Bound]:
    """Return two bounds: the tightest of impacts between bottles, and the tightest of impacts on rails."""
    tightest: dict[str, Bound] = {}
    for impact in expected:
        bound = impact.bound(tolerance)
        if impact.what not in tightest or bound.dt < tightest[impact.what].dt:
            tightest[impact.what] = bound
    return list(tightest.values())


def _at(meeting: Meeting, terms: Terms, speed: float) -> str:
    law, k = meeting.elastic
    return f"{law.coefficient_text(k, terms.laws.curves)} {speed:g} m/s"
