# SPDX-License-Identifier: Apache-2.0
"""Loads on bottles and rails against values computed by hand. Their evaluation changes no bit."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import MASS, NO_OUTPUTS, RADIUS, arc, belt, bottle, kind, line, scene, segment, simulation

from conveyor_sim.columns.damage import DamageColumns, RailWearColumns
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.state import State
from conveyor_sim.simulation import Simulation

WEIGHT = MASS * 9.81
PRESS = 0.4 * WEIGHT
"""N, of a belt on a bottle that it can't take along."""
STIFFNESS = 8000.0
"""N/m, glass on steel."""
HEIGHTS = {"contact_height": 0.1, "gravity_height": 0.08}
LIMITS = {"scuffing_work": 0.02, "crushing_force": 1.5, "impact_speed": 0.9, "tipping": 0.5}
HELD, BEHIND, DRAGGED, LEFT, RIGHT, OBLIQUE, BOWLED = range(7)


def experiments(**fields: Any) -> dict[str, Any]:
    """Two bottles queue, one is dragged, two meet, one bounces, one runs round a bowl; the floor has no friction.

    The little line's laws, but that queues come to rest soon.
    """
    parts = line(floor={"friction": 0.0}, infeeds={}, outfeeds={}, outputs={**NO_OUTPUTS, "damage": 2}, limits=LIMITS)
    for place in (0, 3):
        parts["contacts"][place]["damping"]["coefficient"] = 20.0
    parts["bottle_types"] = {"bottle": kind(**HEIGHTS), "small": parts["bottle_types"]["small"]}
    parts["belts"] |= {
        "stop": belt(0.5, (20.0, -0.5), 2.0, 1.0),
        "press": belt(10.0, (30.0, 1.0), 2.0, 3.0, angle="-90 deg"),
    }
    parts["rails"] |= {
        "stop": segment((21.0, -0.5), (21.0, 0.5)),
        "wall": segment((30.0, 0.0), (33.0, 0.0)),
        "floor": segment((59.0, 0.0), (62.0, 0.0)),
        "bowl": arc((70.0, 0.0), 1.0, math.radians(170.0), math.radians(200.0)),
    }
    parts["bottles"] = [
        bottle(21.0 - RADIUS, 0.0),
        bottle(21.0 - 3.0 * RADIUS, 0.0),
        bottle(30.2, RADIUS, 1.0),
        bottle(50.0, 0.0, 0.5, type="small"),
        bottle(50.07, 0.0, -0.5, type="small"),
        bottle(60.0, RADIUS + 1e-4, 1.0, -0.2),
        bottle(70.0, RADIUS - 1.0, 1.0),
    ]
    return {**parts, **fields}


def damage_of(sim: Simulation) -> DamageColumns:
    damage = sim.damage()
    assert damage is not None
    return damage


def wear_of(sim: Simulation) -> RailWearColumns:
    wear = sim.rail_wear()
    assert wear is not None
    return wear


@dataclass(frozen=True)
class Done:
    """The experiments after a second, what was borne in its first half and in its second."""

    sim: Simulation
    early: DamageColumns
    late: DamageColumns


@pytest.fixture(scope="module", params=["semi_implicit_euler", "velocity_verlet"])
def done(request: pytest.FixtureRequest) -> Done:
    sim = simulation(**experiments(accuracy={"per_tick": 100, "integrator": request.param}))
    sim.advance(50)
    early = damage_of(sim)
    sim.advance(50)
    return Done(sim, early, damage_of(sim))


def test_a_bottle_dragged_along_a_rail_takes_its_friction_times_the_way_it_slips(done: Done) -> None:
    state = done.sim.bottles()
    slipped = state.x[DRAGGED] - 30.2 + RADIUS * state.theta[DRAGGED]
    assert slipped > 0.3
    # The belt pulls at a slant of up to 1/10, and 0.5 % less straight.
    assert done.late.scuffing_work[DRAGGED] == pytest.approx(0.1 * PRESS * slipped, rel=5e-3)
    assert done.late.scuffing_work[[HELD, BEHIND, LEFT, RIGHT]] == pytest.approx(np.zeros(4), abs=1e-9)


def test_the_rail_bears_it_where_the_bottle_slid(done: Done) -> None:
    wear, state = wear_of(done.sim), done.sim.bottles()
    wall = wear.rail == done.sim.model.rails.index("wall")
    assert wear.scuffing_work[wall].sum() == pytest.approx(done.late.scuffing_work[DRAGGED], rel=1e-12)
    assert wear.impulse[wall].sum() == pytest.approx(PRESS, rel=5e-3)
    worn = wear.x[wall][wear.scuffing_work[wall] > 0.0]
    assert (worn.min(), worn.max()) == pytest.approx((30.2, state.x[DRAGGED]), abs=0.05)
    assert wear.length[wall] == pytest.approx(np.full(60, 0.05))
    assert wear.y[wall] == pytest.approx(np.zeros(60))
    # A bin that was crossed: its length over the speed there, at first 1 m/s.
    assert wear.impulse[wall][5] == pytest.approx(PRESS * 0.05, rel=0.1)


def test_the_rail_of_a_bowl_bears_what_turns_the_bottle_round(done: Done) -> None:
    """m v dphi in each bin that was crossed; friction slows it by a tenth in a radian, from the bottom on."""
    wear, state = wear_of(done.sim), done.sim.bottles()
    bowl = wear.rail == done.sim.model.rails.index("bowl")
    x, y, impulse = wear.x[bowl] - 70.0, wear.y[bowl], wear.impulse[bowl]
    assert np.hypot(x, y) == pytest.approx(np.ones(70))
    passed = np.arctan2(state.x[BOWLED] - 70.0, -state.y[BOWLED])
    angle, bins = np.arctan2(x, -y), math.radians(200.0) / 70.0
    crossed = (angle > 0.5 * bins) & (angle < passed - 0.5 * bins)
    assert crossed.sum() > 15
    expected = MASS * bins * np.exp(-0.1 * angle[crossed])
    # It rings as it comes off its line at first, and rolls in the end.
    assert impulse[crossed][3:] == pytest.approx(expected[3:], rel=0.05)
    assert not impulse[(angle < -0.5 * bins) | (angle > passed + 0.5 * bins)].any()


def test_a_queue_on_a_running_belt_is_pressed_with_mu_m_g_a_bottle(done: Done) -> None:
    """The second presses the first with mu m g, and both the stop with twice that."""
    assert done.late.crushing_force[[HELD, BEHIND]] == pytest.approx([3.0 * PRESS, PRESS], rel=1e-4)
    assert done.late.opposed_force[[HELD, BEHIND]] == pytest.approx([PRESS, 0.0], rel=1e-4)
    assert done.late.impact_force[[HELD, BEHIND]] == pytest.approx([2.0 * PRESS, PRESS], rel=1e-4)


def test_impacts_are_told_at_the_speed_just_before_and_the_force_in_the_middle(done: Done) -> None:
    early, late = done.early, done.late
    assert early.impact_speed[[LEFT, RIGHT]] == pytest.approx([1.0, 1.0], rel=1e-12)
    # v sqrt(k m_r), no damping; a peak between two steps is missed by (pi/n)^2 / 8.
    force = 1.0 * math.sqrt(2000.0 * 0.025)
    assert early.impact_force[[LEFT, RIGHT]] == pytest.approx([force, force], rel=2e-3)
    assert early.impact_speed[OBLIQUE] == pytest.approx(0.2, rel=1e-12)
    # A contact that lasts closed long ago.
    assert late.impact_speed.tolist() == [0.0] * 7
    assert late.impact_force[[LEFT, RIGHT, OBLIQUE]].tolist() == [0.0] * 3


def test_an_oblique_impact_scuffs_by_its_impulse_times_the_mean_slip(done: Done) -> None:
    """Slip falls in proportion to the impulse of friction, mu times that of the rebound."""
    state = done.sim.bottles()
    slip = state.vx[OBLIQUE] + RADIUS * state.omega[OBLIQUE]
    impulse = MASS * (1.0 - state.vx[OBLIQUE])
    assert done.late.scuffing_work[OBLIQUE] == pytest.approx(impulse * 0.5 * (1.0 + slip), rel=0.01)


def test_the_index_of_tipping_is_that_of_a_load_that_lasts(done: Done) -> None:
    """Contact and base exert mu m g each, one against the other: |F_c (h_c - h_cg) - F_b h_cg| = mu m g h_c."""
    index = 0.4 * HEIGHTS["contact_height"] / RADIUS
    assert done.late.tipping[[HELD, BEHIND]] == pytest.approx([index, index], rel=2e-3)
    assert np.isnan(done.late.tipping[[LEFT, RIGHT]]).all()


def test_what_goes_beyond_a_limit_is_told_once_with_bottle_place_and_time() -> None:
    sim = simulation(**experiments())
    sim.advance(100)
    events = sim.take_events().damage
    assert sim.take_events().damage == []
    told = {(event.kind, event.bottle): event for event in events}
    assert len(told) == len(events)
    beyond = {kind: {bottle for told_kind, bottle in told if told_kind == kind} for kind in LIMITS}
    assert beyond == {
        "scuffing_work": {DRAGGED},
        "crushing_force": {HELD, LEFT, RIGHT, OBLIQUE},
        "impact_speed": {LEFT, RIGHT},
        "tipping": {HELD, BEHIND, DRAGGED},
    }
    # They meet after 1 cm at 1 m/s.
    hit = told["impact_speed", LEFT]
    assert (hit.tick, hit.limit) == (2, 0.9)
    assert (hit.x, hit.y) == pytest.approx((50.005, 0.0), abs=0.005)
    assert hit.text.startswith("bottle 3 hits, or is hit, at 1 m/s at (50.0")
    assert hit.text.endswith("at 0.02 s: limits.impact_speed is 0.9 m/s")
    # 1 - exp(-t/delay) of the index in the end.
    late = math.sqrt(HEIGHTS["gravity_height"] / 9.81) * -math.log(1.0 - 0.5 * RADIUS / (0.4 * 0.1))
    assert told["tipping", BEHIND].tick == pytest.approx(math.ceil(late / 0.01), abs=1)
    scuffed = told["scuffing_work", DRAGGED]
    assert 0.02 < scuffed.value < 0.02 + 0.1 * PRESS * 0.01


def test_an_outfeed_clogs_when_bottles_wait_before_it() -> None:
    """The bottle held at the stop waits in front of an outfeed that nothing reaches."""
    exits = {"end": {"region": [[21.2, -0.5], [21.8, -0.5], [21.8, 0.5], [21.2, 0.5]]}}
    sim = simulation(**experiments(outfeeds=exits, limits={**LIMITS, "clogging_time": 0.3}))
    sim.advance(100)
    (event,) = [event for event in sim.take_events().damage if event.kind == "clogging_time"]
    assert (event.tick, event.bottle) == (30, HELD)
    assert "outfeed end has removed nothing for 0.3 s" in event.text
    sim.command(["belts/stop/cmd_speed", "belts/press/cmd_speed"], [0.0, 0.0])
    sim.advance(100)
    assert [event for event in sim.take_events().damage if event.kind == "clogging_time"] == []


ASKED: dict[str, Any] = {"outputs": {**NO_OUTPUTS, "damage": 1}, "limits": {"impact_speed": 0.05, "tipping": 0.1}}


def filling(**fields: Any) -> dict[str, Any]:
    """The little line, with heights."""
    parts = line(**fields)
    return {**parts, "bottle_types": {name: kind | HEIGHTS for name, kind in parts["bottle_types"].items()}}


def assert_same(one: Simulation, other: Simulation) -> None:
    """Assert equal bits of all loads."""
    for mine, theirs in ((damage_of(one), damage_of(other)), (wear_of(one), wear_of(other))):
        for name in type(mine).__dataclass_fields__:
            np.testing.assert_array_equal(getattr(mine, name), getattr(theirs, name))


def test_to_look_changes_nothing_and_threads_and_checkpoints_do_not_show(tmp_path: Path) -> None:
    """Bottles come and go, slots and lists grow."""
    plain = Simulation(scene(**line()))
    one, two = (Simulation(scene(**filling(**ASKED)), threads) for threads in (1, 2))
    parted = Simulation(scene(**filling(**ASKED)), 1)
    for sim in (plain, one, two):
        sim.advance(400)
    parted.advance(215)
    parted.save(tmp_path / "parted")
    parted = Simulation.load(tmp_path / "parted", 2)
    parted.advance(185)
    assert plain.damage() is None and plain.rail_wear() is None and plain.take_events().damage == []
    assert one.state_hash() == two.state_hash() == parted.state_hash() == plain.state_hash()
    assert one.counts.removed > 5
    damage, wear = damage_of(one), wear_of(one)
    assert damage.scuffing_work.max() > 0.0 and damage.crushing_force.max() > 0.0 and damage.impact_speed.max() > 0.0
    assert all(wear.impulse[wear.rail == one.model.rails.index(rail)].any() for rail in ("fence", "left", "outer"))
    assert_same(one, two)
    assert_same(one, parted)
    events = one.take_events().damage
    assert {event.kind for event in events} == {"impact_speed", "tipping"}
    assert two.take_events().damage == parted.take_events().damage == events


def test_a_tick_done_again_in_shorter_steps_is_noted_once() -> None:
    """A bottle too fast for the steps has every tick done again in a quarter of them."""
    bottles = [*experiments()["bottles"], bottle(0.0, -50.0, 40.0, type="small")]
    again, short = (simulation(**experiments(bottles=bottles, accuracy={"per_tick": steps})) for steps in (50, 200))
    for sim in (again, short):
        sim.advance(20)
    assert (again.integration.shortened_ticks, short.integration.shortened_ticks) == (20, 0)
    assert_same(again, short)
    assert again.take_events().damage == short.take_events().damage


def test_absent_effects_have_no_arrays() -> None:
    """Each alone brings its own."""
    assert State(build_model(scene(**line()))).world.damage is None
    asked = {"scuffing_work": "scuffing", "opposed_force": "crushing", "impact_force": "impacts", "tipping": "tipping"}
    for limit, effect in asked.items():
        damage = State(build_model(scene(**filling(limits={limit: 1.0})))).world.damage
        assert damage is not None
        assert [name for name in damage._fields if getattr(damage, name) is not None] == [effect]
