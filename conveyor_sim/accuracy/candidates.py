# SPDX-License-Identifier: Apache-2.0
"""The settings that are compared on a scene, and the integrators that its effects forbid."""

import math
from typing import Any

from conveyor_sim.accuracy.setting import Setting, scaled_contacts, with_setting
from conveyor_sim.engine.integrators import INTEGRATORS, SWEPT
from conveyor_sim.errors import SceneError
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.timestep.presets import PRESETS
from conveyor_sim.scene import Scene, parse_again, parse_overrides
from conveyor_sim.scene.accuracy import Preset, explicit
from conveyor_sim.scene.geometry import belt_shapes

STEPS = {
    "leapfrog": (4.0, 2.0, 1.0, 0.5, 0.25, 0.125),
    "semi_implicit_euler": (4.0, 2.0, 1.0, 0.5, 0.25, 0.125),
    "velocity_verlet": (4.0, 2.0, 1.0, 0.5, 0.25, 0.125),
    "rk4": (4.0, 2.0, 1.0, 0.5, 0.25, 0.125),
    "linearly_implicit": (16.0, 8.0, 4.0, 2.0, 1.0, 0.5),
}
"""Time steps of methods whose step is fixed, in those of the preset `standard`."""

ERRORS = {1e-3: 2.0, 1e-4: 1.0, 1e-5: 0.5, 1e-6: 0.25}
"""Settings of dormand_prince: error per step (m/s) and longest step. Peaks are sampled at steps, so a small error with
long steps would miss them.
"""

SWEEPS = ((4, 1), (8, 1), (8, 2), (16, 1), (16, 2))
"""Settings of impulses: steps per tick, and sweeps in a step."""

STIFFNESS = (1.0 / 4.0, 1.0 / 16.0, 1.0 / 64.0)


def preset_setting(scene: Scene, preset: Preset, stiffness: float = 1.0) -> Setting:
    """Return the steps of a preset with leapfrog, with every stiffness multiplied by `stiffness`."""
    overrides = {**parse_overrides(scene.overrides_text), "accuracy": {**_NOTHING, "preset": preset}}
    if stiffness != 1.0:
        overrides["contacts"] = scaled_contacts(scene, stiffness)
    model = build_model(parse_again(scene.source_text, scene.source_name, overrides))
    return Setting(model.integrator, model.steps_per_tick, stiffness)


def standard_steps(scene: Scene) -> int:
    """Return the steps per tick of the preset `standard` with leapfrog."""
    return preset_setting(scene, "standard").per_tick


_NOTHING = {**explicit("leapfrog", 1), "per_tick": None}


def own_setting(scene: Scene) -> Setting:
    """Return the setting of the scene itself."""
    model = build_model(scene)
    error = model.settings.error if model.integrator == "dormand_prince" else None
    return Setting(model.integrator, model.steps_per_tick, error=error, sweeps=model.sweeps or None)


def forbidden(scene: Scene, **fields: Any) -> dict[str, str]:
    """Integrators that can't run the scene, with other fields laid over it, and why."""
    reasons = {}
    for integrator in INTEGRATORS:
        try:
            with_setting(scene, Setting(integrator, 1), **fields)
        except SceneError as error:
            reasons[integrator] = str(error)
    return reasons


def compared(scene: Scene) -> list[str]:
    """Return the integrators of forces that can run the scene.

    Without semi_implicit_euler where leapfrog gives the same bits.
    """
    banned = {*forbidden(scene), *SWEPT}
    same = not any(shape.kind == "curved" for shape in belt_shapes(scene))
    return [name for name in INTEGRATORS if name not in banned and not (same and name == "semi_implicit_euler")]


def candidates(scene: Scene) -> list[Setting]:
    """Return the settings to compare.

    These are the scene's setting, the presets, every integrator at several steps around the standard, impulses, and
    softer contacts.
    """
    standard = standard_steps(scene)
    found = [own_setting(scene), *(preset_setting(scene, preset) for preset in PRESETS)]
    for integrator in compared(scene):
        if integrator == "dormand_prince":
            found += [Setting(integrator, _divided(standard, factor), error=error) for error, factor in ERRORS.items()]
        else:
            found += [Setting(integrator, _divided(standard, factor)) for factor in STEPS[integrator]]
    swept = () if "impulses" in forbidden(scene) else SWEEPS
    found += [Setting("impulses", steps, sweeps=sweeps) for steps, sweeps in swept]
    return list(dict.fromkeys([*found, *softer(scene)]))


def softer(scene: Scene) -> list[Setting]:
    """Return the preset `standard` at the scene's stiffness and at lower ones.

    Softer contacts last longer, so they need fewer steps, within the other bounds of the scene.
    """
    return [preset_setting(scene, "standard", factor) for factor in (1.0, *STIFFNESS)]


def _divided(steps: int, factor: float) -> int:
    return max(1, math.ceil(steps / factor))
