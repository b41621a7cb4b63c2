# SPDX-License-Identifier: Apache-2.0
"""Choice of the steps per tick with its reasons; it needs no arrays of the Model."""

from dataclasses import dataclass

from conveyor_sim.physics.effects.choice import bounds_of, choose_effects, impacts_of
from conveyor_sim.physics.effects.declaration import EffectChoice
from conveyor_sim.physics.effects.terms import Terms
from conveyor_sim.physics.laws.coefficients import build_laws
from conveyor_sim.physics.plant import Plant
from conveyor_sim.physics.timestep.bounds import Bound, fewest_steps, steps_per_tick
from conveyor_sim.physics.timestep.prediction import Impact
from conveyor_sim.physics.timestep.presets import Target, target
from conveyor_sim.scene.schema import Scene


@dataclass(frozen=True, eq=False)
class StepChoice:
    """Steps in a tick of a scene, and the reasons."""

    effects: tuple[EffectChoice, ...]
    aim: Target
    terms: Terms
    impacts: tuple[Impact, ...]
    bounds: tuple[Bound, ...]
    given: int | None
    """Steps given in the scene; None if the bounds set them."""
    steps: int
    reason: str


def choose_steps(plant: Plant) -> StepChoice:
    """Choose the steps in a tick. Raise SceneError if an effect can't be forced as the scene says."""
    scene, effects = plant.scene, choose_effects(plant)
    on = frozenset(effect.name for effect in effects if effect.on)
    aim = target(scene.accuracy)
    terms = Terms(plant, build_laws(scene, plant.rail_materials, on), on, aim.tolerance)
    impacts = impacts_of(terms)
    bounds = bounds_of(terms, impacts)
    given = _given_steps(scene)
    steps, reason = steps_per_tick(scene.tick, bounds, given, aim.words)
    if scene.accuracy.sweeps is not None:
        reason = f"{steps} steps a tick, {scene.accuracy.sweeps} sweeps each, given in the scene"
    return StepChoice(effects, aim, terms, impacts, bounds, given, steps, reason)


def _given_steps(scene: Scene) -> int | None:
    """Return the steps per tick given in the scene; None without."""
    if scene.accuracy.dt is not None:
        return fewest_steps(scene.tick, scene.accuracy.dt)
    return scene.accuracy.per_tick
