# SPDX-License-Identifier: Apache-2.0
"""Description of a rail that presses on a bottle: rail, bottle, counterpart and force."""

from __future__ import annotations

from typing import Any

import pytest
from scenes import NO_FLOOR, RADIUS, bottle, contact, scene, segment
from worlds import ALONE, state_of

from conveyor_sim.physics.stepping.guard.squeeze import Squeeze, squeeze_of

DEEP = 1e-3
"""m, of every contact."""
PITCH = 2.0 * RADIUS - DEEP
COMMON = {"material": "steel", "max_speed": 1.0, "acceleration": 1.0}
ROW = [(RADIUS - DEEP + i * PITCH, 0.0) for i in range(3)]
"""Three bottles between the pusher and the wall."""


def squeeze(slot: int, points: Any, moves: tuple[int, ...], **fields: Any) -> Squeeze | None:
    """Return the squeeze of a bottle while some rails move: pusher p, then diverter d about (0, 2)."""
    wall = ROW[-1][0] + RADIUS - DEEP
    given = {
        "contacts": [contact(1e5), contact(1e5, "steel")],
        "bottles": [bottle(9.0, 9.0), bottle(9.0, 8.0)],
        "rails": {"wall": segment((wall, -1.0), (wall, 1.0))},
        "pushers": {"p": {"from": [0.0, -0.2], "to": [0.0, 0.2], "direction": 0.0, "stroke": 0.1, **COMMON}},
        "diverters": {"d": {"from": [0.0, 2.0], "to": [0.5, 2.0], "angle": 0.5, **COMMON}},
        **fields,
    }
    state = state_of(scene(**NO_FLOOR, **given), points)
    moving = state.world.moving
    assert moving is not None
    moving.speed[list(moves)] = 0.1
    return squeeze_of(state.model, state.world, ALONE.rail_contacts, slot)


@pytest.mark.parametrize("slot", [0, 1, 2])
def test_a_row_before_a_pusher(slot: int) -> None:
    """Whichever bottle the guard objects to: what pushes is at the other end of the row."""
    said = "pusher p pushes bottle 0 and 2 more against rail wall"
    assert squeeze(slot, ROW, (0,)) == Squeeze(said, "force_limit", 294.5, True)


def test_a_row_without_a_wall_is_held_by_its_second_bottle() -> None:
    said = "pusher p pushes bottle 0 against bottle 1"
    assert squeeze(1, ROW[:2], (0,)) == Squeeze(said, "force_limit", 294.5, True)


def test_a_rail_at_rest_squeezes_no_bottle() -> None:
    assert squeeze(1, ROW, ()) is None
    assert squeeze(1, ROW, (1,)) is None


def test_a_diverter_has_a_torque() -> None:
    """So its force falls with the distance from its pivot; free bottles are held by nothing."""
    points = [*ROW, (0.25, 2.0 + RADIUS - DEEP)]
    said = "diverter d swings against bottle 3"
    assert squeeze(3, points, (0, 1)) == Squeeze(said, "torque_limit", pytest.approx(14.7 / 0.25), False)
    arm = {"from": [0.0, 2.0], "to": [0.5, 2.0], "angle": 0.5, "torque_limit": "none", **COMMON}
    assert squeeze(3, points, (1,), diverters={"d": arm}) == Squeeze(said, "torque_limit", None, False)
