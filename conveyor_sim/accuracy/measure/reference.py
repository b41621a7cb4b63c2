# SPDX-License-Identifier: Apache-2.0
"""The setting that errors are measured against."""

import math

from conveyor_sim.accuracy.candidates import forbidden, standard_steps
from conveyor_sim.accuracy.cases.collision import collision_of, duration, terms_of
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.accuracy.trajectory import variant
from conveyor_sim.physics.effects.terms import meetings
from conveyor_sim.scene import Scene, parse_again, parse_overrides
from conveyor_sim.simulation import Simulation

STEPS = 200
"""In the shortest contact: its peak, which is sampled at steps, to (pi / n)^2 / 8 = 3e-5."""

ERROR = 1e-9
"""m/s, of a step."""

FINEST = 32
"""Steps in one of the preset `standard`, where dormand_prince can't run the scene."""


def reference_setting(scene: Scene) -> Setting:
    """dormand_prince; where springs or moving rails forbid it, velocity Verlet in very short steps.

    Leapfrog in the same steps is of first order in damping and friction: it is itself off by 0.02 % in springs.
    """
    scene = with_explicit_friction(scene)
    terms = terms_of(scene)
    speed = terms.plant.impact_speed
    shortest = min((duration(collision_of(meeting, terms), speed) for meeting in meetings(terms)), default=math.inf)
    standard = standard_steps(scene)
    steps = max(standard, math.ceil(STEPS * scene.tick / shortest))
    if "dormand_prince" in forbidden(scene):
        return Setting("velocity_verlet", max(FINEST * standard, steps))
    return Setting("dormand_prince", steps, error=ERROR)


def reference_simulation(scene: Scene, setting: Setting) -> Simulation:
    """Build the scene with a reference setting and explicit friction: in short steps both solvers have one law."""
    return variant(with_explicit_friction(scene), setting)


def with_explicit_friction(scene: Scene) -> Scene:
    """Return the scene with the explicit friction solver."""
    if scene.friction_solver == "explicit":
        return scene
    overrides = {**parse_overrides(scene.overrides_text), "friction_solver": "explicit"}
    return parse_again(scene.source_text, scene.source_name, overrides)
