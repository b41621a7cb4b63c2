# SPDX-License-Identifier: Apache-2.0
"""The presets keep their promise on scenes that nothing was calibrated on.

docs/accuracy.md shows the same for the scenes that it is made from.
"""

from __future__ import annotations

import pytest
from scenes import base, belt, line, polyline, scene

from conveyor_sim.accuracy.candidates import preset_setting
from conveyor_sim.accuracy.measure.precision import WorkPrecision
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.timestep.presets import PRESETS
from conveyor_sim.scene import Scene


def silent(_done: float, _whole: float) -> None:
    pass


def mixed_line() -> Scene:
    """Two types of bottles, four laws, an infeed that packs, a bend; a queue builds up at the slow end."""
    return scene(**line(accuracy={}, duration=3.0))


def hertz_on_a_table() -> Scene:
    """Bottles with Hertz contacts of restitution 0.7, pressed into a corner by the belt below them."""
    laws = {"hertz_stiffness": 4e5, "damping": {"law": "normal", "restitution": 0.7}, "friction": 0.15}
    return scene(
        duration=2.0,
        contacts=[{"between": ["glass", other], **laws} for other in ("glass", "steel")],
        base=base(0.25),
        belts={"belt": belt(0.4, angle="20 deg")},
        rails={"corner": polyline([(-2.0, 1.2), (1.0, 1.2), (1.0, -2.0)])},
        bottles=[{"grid": {"type": "bottle", "origin": [0.0, 0.2], "rows": 4, "columns": 5, "pitch": 0.14}}],
    )


SCENES = {
    "mixed line": mixed_line,
    "hertz on a table": hertz_on_a_table,
}


@pytest.mark.parametrize("name", SCENES)
def test_presets_keep_their_promise(name: str) -> None:
    """The error in peak force, measured on the scene, is within the preset's tolerance."""
    loaded = SCENES[name]()
    settings = {preset: preset_setting(loaded, preset) for preset in PRESETS}
    precision = WorkPrecision(loaded)
    precision.find_starts(silent)
    precision.find_horizons(silent)
    doubt = precision.make_reference(silent).doubt.peak_force
    assert doubt < 0.1 * min(PRESETS.values())
    points = precision.measure(list(settings.values()), silent)
    for (preset, tolerance), point in zip(PRESETS.items(), points, strict=True):
        assert not point.failure
        assert point.errors is not None
        assert point.errors.peak_force <= tolerance, preset


def test_a_scene_that_says_nothing_is_standard() -> None:
    loaded = hertz_on_a_table()
    assert build_model(loaded).steps_per_tick == preset_setting(loaded, "standard").per_tick
