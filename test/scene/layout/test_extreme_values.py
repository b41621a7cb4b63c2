# SPDX-License-Identifier: Apache-2.0
"""Values of layouts beyond every double are refused in words."""

from __future__ import annotations

import pytest

from conveyor_sim.errors import SceneError
from conveyor_sim.scene import parse_scene

SCENE = """
name: extreme
duration: 1
bottle_types: {jar: {radius: 33 mm, mass: 350 g, material: glass}}
contacts: [{between: [glass, glass], stiffness: 5 kN/m}]
base: [{between: [glass, chain], friction: 0.2}]
"""
HUGE = hex(2**1024 - 1)
LANE = "{start: [0, 0], heading: 0, path: [{straight: 1}], width: 0.1, material: chain, %s}"
FEED = "infeeds: {feed: {along: lane, at: 0.1, bottle: jar, rate: 1}}"
DRIVE = f"drives: {{d: {{speed: {HUGE}, acceleration: 1}}}}"
SQUARES = ", ".join(f"a{n}: a{n - 1} * a{n - 1}" for n in range(1, 14))


@pytest.mark.parametrize(
    ("text", "field"),
    [
        (f"parameters: {{a: {HUGE}}}", "parameters.a"),
        (f"parameters: {{a: {{default: 2, max: {HUGE}}}}}", "parameters.a.max"),
        (f"parameters: {{a0: 180 deg / 1 rad, {SQUARES}, z: {{default: a13, min: 1}}}}", "parameters.a10"),
        (f"conveyors: {{lane: {LANE % f'speed: {HUGE}'}}}\n{FEED}", "conveyors.lane.speed"),
        (f"conveyors: {{lane: {LANE % 'drive: d'}}}\n{DRIVE}\n{FEED}", "drives.d.speed"),
    ],
    ids=["parameter", "bound", "powers of pi", "speed", "speed of a drive"],
)
def test_values_beyond_a_double_are_refused(text: str, field: str) -> None:
    with pytest.raises(SceneError, match=field.replace(".", r"\.")):
        parse_scene(SCENE + text, "plant.yaml")
