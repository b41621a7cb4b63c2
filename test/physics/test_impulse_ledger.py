# SPDX-License-Identifier: Apache-2.0
"""Energy ledger and loads of the method of impulses: closed forms, a balance that closes, no bit of the motion."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import MASS, NO_OUTPUTS, RADIUS, arc, base, belt, bottle, kind, scene, segment
from swept import MU_BASE, G, crowd, fields, file_of, forces_on, glass, run

from conveyor_sim.columns.damage import DamageColumns, RailWearColumns
from conveyor_sim.columns.ledger import Ledger
from conveyor_sim.physics.laws.rebounds import peak_factor
from conveyor_sim.simulation import Simulation

HEIGHTS = {"contact_height": 0.1, "gravity_height": 0.08}
TYPES = {"bottle": kind(**HEIGHTS), "big": kind(0.08, 0.4)}
WATCHED: dict[str, Any] = {"outputs": {**NO_OUTPUTS, "ledger": 10, "damage": 10}, "bottle_types": TYPES}
"""Fields that enable every observer."""
DRAG = MU_BASE * MASS * G
ROUNDING = 1e-13
"""Largest residual over the turnover."""


def watched(steps: int = 8, sweeps: int = 2, **more: Any) -> Simulation:
    return run(steps, sweeps, **WATCHED, **more)


def ledger_of(sim: Simulation) -> Ledger:
    """Return the ledger, after a check that it closes."""
    ledger = sim.ledger()
    assert ledger is not None
    assert abs(ledger.residual) < ROUNDING * ledger.turnover
    return ledger


def loads_of(sim: Simulation) -> DamageColumns:
    damage = sim.damage()
    assert damage is not None
    return damage


def wear_of(sim: Simulation) -> RailWearColumns:
    wear = sim.rail_wear()
    assert wear is not None
    return wear


@pytest.mark.parametrize("restitution", [0.0001, 0.5, 1.0])
def test_a_head_on_impact_loses_what_its_restitution_says(restitution: float) -> None:
    """(1 - e^2) / 2 m_r v^2, of unequal bottles."""
    sim = watched(
        contacts=[glass(restitution=restitution), glass("steel")],
        bottles=[bottle(0.0, 0.0, 0.7), bottle(0.2, 0.0, -0.2, type="big")],
    )
    sim.advance(30)
    ledger, reduced = ledger_of(sim), MASS * 0.4 / (MASS + 0.4)
    assert ledger.fed == pytest.approx(0.5 * MASS * 0.7**2 + 0.5 * 0.4 * 0.2**2, rel=1e-14)
    assert ledger.damping == pytest.approx(0.5 * (1.0 - restitution**2) * reduced * 0.9**2, abs=1e-15)
    assert (ledger.contact_friction, ledger.base_friction, ledger.elastic) == pytest.approx((0.0,) * 3, abs=1e-15)


def test_an_oblique_impact_loses_friction_times_the_mean_slip() -> None:
    """The bottle and the rail bear it as sliding work, where they touch."""
    v_t, v_n = 1.5, 0.8
    sim = watched(
        contacts=[glass(), glass("steel", friction=0.2)],
        rails={"rail": segment((-5.0, 0.0), (5.0, 0.0))},
        bottles=[bottle(0.0, RADIUS + 0.01, v_t, -v_n)],
    )
    sim.advance(4)
    state, ledger, loads, wear = sim.bottles(), ledger_of(sim), loads_of(sim), wear_of(sim)
    impulse = MASS * (v_t - state.vx[0])
    slip = state.vx[0] + RADIUS * state.omega[0]
    lost = impulse * 0.5 * (v_t + slip)
    assert ledger.contact_friction == pytest.approx(lost, rel=1e-12)
    assert ledger.damping == pytest.approx(0.5 * MASS * (v_n**2 - state.vy[0] ** 2), rel=1e-12)
    assert loads.scuffing_work == pytest.approx([lost], rel=1e-12)
    there = wear.rail == sim.model.rails.index("rail")
    (struck,) = np.flatnonzero(there & (wear.impulse > 0.0))
    assert wear.scuffing_work[struck] == pytest.approx(lost, rel=1e-12)
    assert wear.impulse[struck] == pytest.approx(MASS * 1.5 * v_n, rel=1e-12)
    assert wear.x[struck] == pytest.approx(v_t * 0.01 / v_n, abs=0.05)


def test_an_arc_bears_an_impact_where_it_was_struck() -> None:
    sim = watched(
        rails={"bowl": arc((0.0, 0.0), 0.5, -math.pi, math.pi)},
        bottles=[bottle(0.3, 0.0, 0.0, -1.0)],
    )
    sim.advance(35)
    state, wear = sim.bottles(), wear_of(sim)
    bowl = wear.rail == sim.model.rails.index("bowl")
    (struck,) = np.flatnonzero(bowl & (wear.impulse > 0.0))
    # The axis is 0.5 m - R from the centre then.
    angle = -math.acos(0.3 / (0.5 - RADIUS))
    place = (0.5 * math.cos(angle), 0.5 * math.sin(angle))
    assert math.hypot(wear.x[struck] - place[0], wear.y[struck] - place[1]) < 0.03
    gained = MASS * math.hypot(state.vx[0], state.vy[0] + 1.0)
    assert wear.impulse[struck] == pytest.approx(MASS * 1.5 * -math.sin(angle), rel=5e-3)
    assert wear.impulse[struck] < gained
    assert wear.scuffing_work[struck] == pytest.approx(ledger_of(sim).contact_friction, rel=1e-12)


def test_a_bottle_set_down_takes_twice_what_it_gets() -> None:
    """The belt does m v^2, of which m v^2 / 2 goes into motion and as much into friction."""
    v = 0.6
    sim = watched(belts={"belt": belt(v)}, bottles=[bottle(0.0, 0.0)])
    sim.advance(60)
    ledger, energy = ledger_of(sim), 0.5 * MASS * v**2
    assert ledger.belt_work == pytest.approx([0.0, 2.0 * energy, 0.0], rel=1e-12)
    assert (ledger.base_friction, ledger.kinetic) == pytest.approx((energy, energy), rel=1e-12)


def test_a_turntable_does_its_speed_times_the_angular_momentum_it_gives() -> None:
    """Up to half a substep, because the belt's velocity is that at the middle of the way."""
    omega = 1.0
    table = {"kind": "curved", "centre": [0.3, -0.2], "inner_radius": 0.0, "width": 1.0, "start_angle": 1.0,
             "span": 2.0 * math.pi, "material": "chain", "speed": 0.5 * omega, "speed_limits": [-9, 9]}  # fmt: skip
    sim = watched(32, belts={"table": table}, bottles=[bottle(0.7, -0.1, 0.2, -0.1)])

    def momentum() -> float:
        state = sim.bottles()
        return MASS * float((state.x[0] - 0.3) * state.vy[0] - (state.y[0] + 0.2) * state.vx[0])

    begun = momentum()
    sim.advance(30)
    ledger = ledger_of(sim)
    assert ledger.belt_work == pytest.approx([0.0, omega * (momentum() - begun), 0.0], rel=5e-3)
    assert ledger.base_friction > 0.0


def test_a_queue_at_rest_turns_the_work_of_the_belt_into_heat() -> None:
    """mu m g v of each bottle, all of it under the bottles."""
    count, speed = 10, 0.3
    sim = watched(16, 2, **file_of(count))
    sim.advance(300)
    before = ledger_of(sim)
    sim.advance(100)
    after = ledger_of(sim)
    work = count * DRAG * speed * 1.0
    assert after.belt_work[1] - before.belt_work[1] == pytest.approx(work, rel=1e-12)
    assert after.base_friction - before.base_friction == pytest.approx(work, rel=1e-5)
    assert after.damping - before.damping == pytest.approx(0.0, abs=1e-5 * work)
    # Its contacts hold N^2 / (2 k).
    held = sum((n * DRAG) ** 2 / 2e8 for n in range(1, count)) + (count * DRAG) ** 2 / 4e8
    assert after.elastic == pytest.approx(held, rel=5e-3)


def test_soft_contacts_store_the_energy_of_an_impact_that_steps_resolve() -> None:
    """A belt presses a bottle against a soft stop: F^2 / (2 k) at rest; the rest of its energy is lost."""
    stiffness = 100.0
    sim = watched(
        contacts=[glass(), glass("steel", stiffness)],
        belts={"belt": belt(0.3)},
        rails={"stop": segment((0.0, -0.3), (0.0, 0.3))},
        bottles=[bottle(-RADIUS, 0.0)],
    )
    sim.advance(300)
    ledger, force = ledger_of(sim), forces_on(sim, "stop")
    assert force == pytest.approx(DRAG, rel=1e-3)
    assert ledger.elastic == pytest.approx(force**2 / (2.0 * stiffness), rel=1e-12)


def pressed_crowd(threads: int = 1, **more: Any) -> Simulation:
    """Return 240 bottles of two sizes, which a belt presses into a corner."""
    return Simulation(scene(**crowd(16, 15, **{**WATCHED, **more})), threads=threads)


def assert_same(one: Any, other: Any) -> None:
    for name in type(one).__dataclass_fields__:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_accounts_depend_neither_on_threads_nor_on_calls_nor_on_checkpoints(tmp_path: Path) -> None:
    one = pressed_crowd()
    one.advance(100)
    ledger, loads, wear = ledger_of(one), loads_of(one), wear_of(one)
    assert min(ledger.base_friction, ledger.contact_friction, ledger.damping, ledger.elastic) > 0.0
    others = [pressed_crowd(2), pressed_crowd(3), pressed_crowd()]
    others[0].advance(100)
    for ticks in (1, 60, 39):
        others[1].advance(ticks)
    others[2].advance(43)
    others[2].save(tmp_path / "there")
    others[2] = Simulation.load(tmp_path / "there", threads=2)
    others[2].advance(57)
    for other in others:
        assert other.full_state_hash() == one.full_state_hash()
        assert_same(ledger_of(other), ledger)
        assert_same(loads_of(other), loads)
        assert_same(wear_of(other), wear)


def test_observers_change_no_bit() -> None:
    shown, hidden = pressed_crowd(), pressed_crowd(outputs=NO_OUTPUTS)
    for sim in (shown, hidden):
        sim.advance(60)
    assert hidden.ledger() is None
    assert hidden.damage() is None
    impulses = hidden._state.world.impulses
    assert impulses is not None
    assert (impulses.work, impulses.loads, hidden._state.world.ledger) == (None, None, None)
    assert shown.state_hash() == hidden.state_hash()


def test_a_line_closes_with_bottles_that_come_and_go() -> None:
    """Fed are m v^2 / 2 of each; a stop presses some of them, and those that are removed take their energy along."""
    sim = watched(
        belts={"belt": belt(0.3, (-1.0, -0.5), 3.0, 1.0)},
        base=base(MU_BASE),
        rails={"guide": segment((-1.0, -0.07), (2.0, -0.05))},
        bottles=[],
        infeeds={"inlet": {"bottle": "bottle", "position": [-0.9, 0.0], "direction": 0, "speed": 0.5, "rate": 2.5}},
        outfeeds={"end": {"region": [[1.0, -0.5], [1.5, -0.5], [1.5, 0.5], [1.0, 0.5]]}},
    )
    sim.advance(1200)
    ledger, counts = ledger_of(sim), sim.counts
    assert counts.removed > 5
    fed = sim.bottles().id.size + counts.removed
    assert ledger.fed == pytest.approx(fed * 0.5 * MASS * 0.5**2, rel=1e-12)
    # Some roll along the guide, and leave with a spin.
    moving = counts.removed * 0.5 * MASS * 0.3**2
    assert 0.95 * moving < ledger.removed < 2.0 * moving
    assert ledger.contact_friction > 0.0


def test_loads_of_a_queue_are_those_of_its_drags() -> None:
    """The second presses the first with mu m g, and both the stop with twice that."""
    sim = watched(16, 2, **file_of(2))
    sim.advance(200)
    loads_of(sim)
    sim.advance(100)
    loads = loads_of(sim)
    assert loads.crushing_force == pytest.approx([3.0 * DRAG, DRAG], rel=1e-4)
    assert loads.opposed_force == pytest.approx([DRAG, 0.0], rel=1e-4)
    assert loads.impact_force == pytest.approx([2.0 * DRAG, DRAG], rel=1e-4)
    assert loads.impact_speed.tolist() == [0.0, 0.0]
    index = MU_BASE * HEIGHTS["contact_height"] / RADIUS
    assert loads.tipping == pytest.approx([index, index], rel=2e-3)


def test_a_bottle_dragged_along_a_rail_takes_its_friction_times_the_way_it_slips() -> None:
    """A belt presses it against the rail with mu_b m g, and the rail brakes it with mu times that."""
    sim = watched(
        32,
        2,
        contacts=[glass(), glass("steel", friction=0.1)],
        belts={"press": belt(10.0, (-1.0, 1.0), 2.0, 5.0, angle="-90 deg")},
        rails={"wall": segment((-1.0, 0.0), (3.0, 0.0))},
        bottles=[bottle(0.2, RADIUS, 1.0)],
    )
    sim.advance(50)
    state, wear = sim.bottles(), wear_of(sim)
    slipped = state.x[0] - 0.2 + RADIUS * state.theta[0]
    assert slipped > 0.1
    assert loads_of(sim).scuffing_work == pytest.approx([0.1 * DRAG * slipped], rel=0.02)
    wall = wear.rail == sim.model.rails.index("wall")
    assert wear.impulse[wall].sum() == pytest.approx(DRAG * 0.5, rel=0.01)
    ledger_of(sim)


STRUCK = {
    "rails": {"rail": segment((-5.0, 0.0), (5.0, 0.0))},
    "bottles": [bottle(0.0, RADIUS + 0.003, 1.5, -0.8), bottle(2.0, 0.5, 0.5), bottle(2.135, 0.52, -0.3)],
}
"""One bottle strikes a rail, two meet."""


def test_loads_of_free_impacts_are_those_of_forces() -> None:
    """Within the predicted error of explicit steps, and that of a normal up to a substep older than the touch."""
    swept = watched(**STRUCK)
    forced = Simulation(
        scene(**fields(**WATCHED, **STRUCK) | {"accuracy": {"integrator": "velocity_verlet", "per_tick": 20_000}})
    )
    for sim in (swept, forced):
        sim.advance(2)
    one, other = loads_of(swept), loads_of(forced)
    assert one.impact_speed.min() > 0.5
    predicted = forced.model.prediction.value
    assert predicted is not None
    assert predicted < 0.01
    for name, error in (("impact_speed", 5e-4), ("impact_force", predicted), ("crushing_force", predicted)):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=error, err_msg=name)
    np.testing.assert_allclose(one.scuffing_work, other.scuffing_work, rtol=0.03)
    mine, theirs = ledger_of(swept), forced.ledger()
    assert theirs is not None
    assert mine.damping == pytest.approx(theirs.damping, rel=0.02)


def test_an_impact_beyond_a_limit_is_reported_with_its_closed_form() -> None:
    sim = watched(bottles=[bottle(0.0, 0.0, 0.5), bottle(0.2, 0.0)], limits={"impact_force": 500.0, "tipping": 9.0})
    sim.advance(30)
    law = sim.model.pair_law
    assert law is not None and law.damping_normal is not None
    root = math.sqrt(1e8 * 0.5 * MASS)
    peak = 0.5 * root * peak_factor(law.damping_normal[0] / (2.0 * root))
    events = sim.take_events().damage
    assert [(event.kind, event.bottle) for event in events] == [("impact_force", 0), ("impact_force", 1)]
    assert [event.value for event in events] == pytest.approx([peak, peak], rel=1e-12)
