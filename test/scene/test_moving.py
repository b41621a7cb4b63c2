# SPDX-License-Identifier: Apache-2.0
"""Positions of moving rails, and the boxes that they sweep, against closed forms."""

import math

import numpy as np
import pytest
from scenes import contact, scene

from conveyor_sim.scene.bodies import AxisShape, BodyShape
from conveyor_sim.scene.moving import mover_shape, movers_of

SWING = {"material": "steel", "max_speed": 1.0, "acceleration": 5.0}


def shapes(**fields: object) -> list[tuple[BodyShape, AxisShape]]:
    built = scene(contacts=[contact(1e3, "steel")], **fields)
    return [(body, axis) for bodies, axis in (mover_shape(*mover) for mover in movers_of(built)) for body in bodies]


def test_a_sliding_rail_is_shifted_along_its_direction() -> None:
    gate = {**SWING, "kind": "slide", "from": [1.0, 2.0], "to": [1.0, 3.0], "direction": "150 deg", "stroke": 0.4}
    (closed, _), (_, opened) = shapes(gates={"a": gate, "b": {**gate, "open": True}})
    shift = 0.4 * np.array([-math.sqrt(0.75), 0.5])
    np.testing.assert_allclose(closed.at(0.4)[0].points(), np.array([[1.0, 2.0], [1.0, 3.0]]) + shift, atol=1e-15)
    np.testing.assert_allclose(closed.sweep(0.4), [1.0 + shift[0], 2.0, 1.0, 3.2])
    assert (closed.name, opened.first) == ("gates/a", 0.4)


@pytest.mark.parametrize(("angle", "box"), [(120.0, (-0.5, 0.0, 1.0, 1.0)), (-60.0, (0.0, -math.sqrt(0.75), 1.0, 0.0))])
def test_a_swinging_rail_turns_about_its_start(angle: float, box: tuple[float, ...]) -> None:
    """Counter-clockwise if positive; its end is highest where it crosses the axis."""
    ((arm, axis),) = shapes(diverters={"d": {**SWING, "from": [0.0, 0.0], "to": [1.0, 0.0], "angle": f"{angle} deg"}})
    assert axis.stroke == pytest.approx(math.radians(abs(angle)))
    end = [math.cos(math.radians(angle)), math.sin(math.radians(angle))]
    np.testing.assert_allclose(arm.at(axis.stroke)[0].points(), [[0.0, 0.0], end], atol=1e-15)
    np.testing.assert_allclose(arm.sweep(axis.stroke), box, atol=1e-15)


def test_movers_are_numbered_gates_first() -> None:
    slide = {**SWING, "from": [0.0, 0.0], "to": [1.0, 0.0], "direction": 0.0, "stroke": 0.1}
    names = [
        body.name
        for body, _ in shapes(
            diverters={"d": {**SWING, "from": [0.0, 0.0], "to": [1.0, 0.0], "angle": 1.0}},
            pushers={"p": slide},
            gates={"g": {**slide, "kind": "slide"}},
        )
    ]
    assert names == ["gates/g", "pushers/p", "diverters/d"]
