# SPDX-License-Identifier: Apache-2.0
"""Wear of bodies under axes: booked to places in the frame of the body, whatever its pose."""

import math
from typing import Any

import numpy as np
import pytest
from physics.test_damage import DRAGGED, PRESS, damage_of, experiments, wear_of
from scenes import MASS, NO_OUTPUTS, simulation
from wheel_lines import FAST, PITCH_RADIUS, POCKET_RADIUS, SPEED, screw_line, star_line

from conveyor_sim.columns.damage import RailWearColumns
from conveyor_sim.simulation import Simulation

DAMAGE = {"outputs": {**NO_OUTPUTS, "damage": 2}}


def of_rail(sim: Simulation, name: str) -> RailWearColumns:
    """Return the bins of one rail."""
    wear = wear_of(sim)
    own = wear.rail == sim.model.rails.index(name)
    return RailWearColumns(*(getattr(wear, field)[own] for field in RailWearColumns.__dataclass_fields__))


def wall(speed: float) -> dict[str, Any]:
    """Return the experiments of `test_damage` with a pusher in place of the wall, which slides along itself."""
    parts = experiments()
    parts["rails"].pop("wall")
    parts["pushers"] = {
        "wall": {"from": [30.0, 0.0], "to": [33.0, 0.0], "material": "steel", "direction": 0.0, "stroke": 1.0,
                 "max_speed": max(speed, 0.1), "acceleration": 1e9, "force_limit": "none"}
    }  # fmt: skip
    return parts


def test_body_at_rest_wears_as_a_rail_at_rest() -> None:
    """A bottle is dragged along both: the same work and impulse in each bin."""
    rail, body = simulation(**experiments()), simulation(**wall(0.0))
    for sim in (rail, body):
        sim.advance(60)
    expected, worn = of_rail(rail, "wall"), of_rail(body, "pushers/wall")
    for field in ("x", "y", "length", "scuffing_work", "impulse"):
        assert getattr(worn, field) == pytest.approx(getattr(expected, field), rel=1e-9, abs=1e-12)
    assert worn.scuffing_work.sum() > 0.01


def test_moving_body_bears_friction_times_slip_where_the_bottle_was_on_it() -> None:
    """The belt presses the bottle with mu m g for a second; the wall slides away from under it at 0.5 m/s."""
    sim = simulation(**wall(0.5))
    sim.command(["pushers/wall/push"], [1.0])
    sim.advance(100)
    state, damage, worn = sim.bottles(), damage_of(sim), of_rail(sim, "pushers/wall")
    assert worn.impulse.sum() == pytest.approx(PRESS, rel=5e-3)
    assert worn.scuffing_work.sum() == pytest.approx(damage.scuffing_work[DRAGGED], rel=1e-9)
    places = worn.x[worn.impulse > 0.0]
    assert (places.min(), places.max()) == pytest.approx((30.2, state.x[DRAGGED] - 0.5), abs=0.05)
    # Friction of the wall, and the belt, which pulls at a slant of 1/10, brake it: v^2 = 0.25 - 2 a x on the wall.
    slower = 0.1 * PRESS / MASS + 0.4 * 9.81 * 0.093
    assert worn.impulse[5] == pytest.approx(PRESS * 0.05 / math.sqrt(0.25 - 2.0 * slower * 0.075), rel=0.05)


def test_wheel_wears_in_the_pocket_that_carries() -> None:
    """The bins of the wheel lie on pocket 0 at displacement 0, although the wheel has turned; all work is booked."""
    sim = star_line(**DAMAGE)
    sim.advance(round((0.5 + 0.6 * math.pi * PITCH_RADIUS) / SPEED / sim.scene.tick))
    worn = of_rail(sim, "stars/in")
    borne = worn.impulse > 0.0
    assert borne.any()
    from_pocket = np.hypot(worn.x - 1.0, worn.y)
    assert from_pocket[borne] == pytest.approx(np.full(borne.sum(), POCKET_RADIUS), abs=1e-6)
    assert wear_of(sim).scuffing_work.sum() == pytest.approx(damage_of(sim).scuffing_work.sum(), rel=1e-9)


def test_pockets_of_a_screw_are_one_thread() -> None:
    """A train has the bins of one of its bodies, and several bottles wear them."""
    sim = screw_line(speed=FAST, **DAMAGE)
    sim.advance(300)
    worn, screw = of_rail(sim, "screws/in"), sim.scene.screws["in"]
    assert worn.length.sum() == pytest.approx(screw.pocket_radius * screw.opening)
    assert worn.impulse.sum() > 0.0
