# SPDX-License-Identifier: Apache-2.0
"""Sleeping bottles: the same forces and positions as without, and every cause that wakes an island."""

import math

import numpy as np
import pytest
from asleep import asleep, awake_run, sleeping_file
from scenes import MASS, belt, bottle, polyline, segment
from swept import MU_BASE, G, crowd, file_of, forces_on, run

from conveyor_sim.engine.impulses.sleep import BALANCE
from conveyor_sim.simulation import Simulation

DRAG = MU_BASE * MASS * G


def test_a_file_sleeps_on_a_running_belt_with_the_forces_of_its_drags() -> None:
    """Closed form: the stop bears the drag of all; and no bottle moves, to the bit."""
    sim = sleeping_file(20)
    before = sim.bottles()
    sim.advance(200)
    after = sim.bottles()
    for name in ("x", "y", "theta", "vx", "vy", "omega"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
    assert not after.vx.any()
    assert forces_on(sim, "stop") == pytest.approx(20 * DRAG, rel=1e-4)
    contacts = sim.contacts()
    behind = np.sort(contacts.normal_force[contacts.kind == 0])
    assert behind == pytest.approx(np.arange(1, 20) * DRAG, rel=1e-3)


def test_a_crowd_rests_where_it_rests_without_sleep() -> None:
    """Forces on the end wall within 1 % of the friction under all, positions within 50 um."""
    given = {name: value for name, value in crowd(6, 5).items() if name in ("belts", "rails", "bottles")}
    sims = run(16, 2, **given), awake_run(16, 2, **given)
    along = []
    for sim in sims:
        sim.advance(600)
        contacts = sim.contacts()
        on_wall = (contacts.kind == 1) & (contacts.b == list(sim.model.rails).index("walls"))
        forces = contacts.normal_force * contacts.nx + contacts.tangential_force * contacts.ny
        along.append(float(forces[on_wall].sum()))
    assert len(asleep(sims[0])) == 30
    weight = float(sims[0].model.type_mass[sims[0].bottles().type].sum()) * G
    assert along[0] == pytest.approx(along[1], abs=0.01 * MU_BASE * weight)
    np.testing.assert_allclose(sims[0].bottles().x, sims[1].bottles().x, rtol=0.0, atol=5e-5)
    np.testing.assert_allclose(sims[0].bottles().y, sims[1].bottles().y, rtol=0.0, atol=5e-5)


def test_a_thousand_pressed_bottles_come_to_rest() -> None:
    """Closed form: walls bear the drag of all along the belt. It sloshes on if impulses close gaps at once."""
    rows, columns, d = 40, 25, 0.13 * (1.0 + 1e-6)
    bottles = [
        bottle(-(0.5 + row * math.sqrt(0.75)) * d, (0.5 + column + 0.5 * (row % 2)) * d)
        for row in range(rows)
        for column in range(columns)
    ]
    width = (columns + 0.5) * d
    walls = polyline([(-6.0, 0.0), (0.0, 0.0), (0.0, width), (-6.0, width)])
    sim = run(8, 2, belts={"belt": belt(0.2, (-7.0, -1.0), 8.0, 6.0)}, rails={"walls": walls}, bottles=bottles)
    sim.advance(900)
    assert len(asleep(sim)) == 1000
    assert _on_rails(sim) == pytest.approx((1000 * DRAG, 0.0), abs=0.01 * 1000 * DRAG)


@pytest.mark.parametrize(("steps", "sweeps"), [(8, 1), (8, 2), (16, 2)])
def test_rails_of_sleepers_in_a_wedge_bear_their_friction(steps: int, sweeps: int) -> None:
    """Contact forces cancel in the sum of all balances, so the error of the rails is at most that of all bottles."""
    below = belt(0.2, (-3.0, -1.0), 5.0, 3.0)
    wedge = polyline([(-1.5, -0.6), (1.3, 0.44), (-1.5, 1.48)])
    sim = run(steps, sweeps, belts={"belt": below}, rails={"wedge": wedge}, bottles=crowd(6, 5)["bottles"])
    for _ in range(40):
        sim.advance(100)
        if len(asleep(sim)) == 30:
            break
    assert len(asleep(sim)) == 30
    drags = MU_BASE * G * float(sim.model.type_mass[sim.bottles().type].sum())
    assert _on_rails(sim) == pytest.approx((drags, 0.0), abs=2.0 * BALANCE * drags)


def _on_rails(sim: Simulation) -> tuple[float, float]:
    """Return the force of all bottles on all rails, along x and y, N."""
    contacts = sim.contacts()
    on = contacts.kind == 1
    normal, tangential = contacts.normal_force[on], contacts.tangential_force[on]
    nx, ny = contacts.nx[on], contacts.ny[on]
    return float(np.sum(normal * nx + tangential * ny)), float(np.sum(normal * ny - tangential * nx))


def test_sleepers_count_in_peaks() -> None:
    """Closed form: in 0.5 s the first bottle of five bears 5 and 4 drags, so 4.5 drags s."""
    fields = {"outputs": {"bottles": 2}}
    sim = sleeping_file(5, **fields)
    sim.advance(51)
    state = sim.bottles()
    assert asleep(sim) == list(range(5))
    assert state.peak_force[0] == pytest.approx(5 * DRAG, rel=1e-3)
    elapsed = 0.01 * (1 + (sim.tick - 1) % 50)
    assert state.impulse[0] == pytest.approx(9 * DRAG * elapsed, rel=1e-3)
    assert state.impulse[4] == pytest.approx(DRAG * elapsed, rel=1e-3)


def test_bottles_on_a_belt_that_stopped_start_with_it() -> None:
    """Closed form: after its way of acceleration v^2 / (2 mu g) a bottle moves with the belt."""
    sims = [make(belts={"belt": belt(0.3)}, bottles=[bottle(0.0, 0.2 * n, 0.3) for n in range(3)])
            for make in (run, awake_run)]  # fmt: skip
    for sim in sims:
        sim.command(["belts/belt/cmd_speed"], [0.0])
        sim.advance(100)
    assert asleep(sims[0]) == [0, 1, 2]
    start = sims[0].bottles().x
    for sim in sims:
        sim.command(["belts/belt/cmd_speed"], [0.3])
        sim.advance(100)
    assert asleep(sims[0]) == []
    lost = 0.3**2 / (2.0 * MU_BASE * G)
    assert sims[0].bottles().x - start == pytest.approx(0.3 - lost, abs=1e-3)
    np.testing.assert_allclose(sims[0].bottles().x, sims[1].bottles().x, rtol=0.0, atol=1e-6)


def test_a_change_of_the_belt_wakes_those_on_it() -> None:
    """And no others: a bottle on another belt sleeps on."""
    sim = sleeping_file(4, belts={"other": belt(0.0, (3.0, 3.0))}, bottles=[bottle(3.5, 3.5)])
    assert asleep(sim) == [0, 1, 2, 3, 4]
    sim.command(["belts/belt/cmd_speed"], [0.2])
    sim.advance(1)
    assert asleep(sim) == [4]
    sim.advance(150)
    assert asleep(sim) == [0, 1, 2, 3, 4]
    assert forces_on(sim, "stop") == pytest.approx(4 * DRAG, rel=1e-3)


def test_an_arrival_wakes_the_file_before_the_impact() -> None:
    """The impact is that of a file awake: the same speeds after it. Then the stop bears one more drag."""
    gap, speed = 0.6, 0.3
    last = -0.065 - 9 * 0.13 - 0.13
    sim = sleeping_file(10, bottles=[bottle(last - gap, 0.0, speed)])
    other = awake_run(16, 2, **{**file_of(10), "bottles": [*file_of(10)["bottles"], bottle(last - gap, 0.0, speed)]})
    other.advance(100)
    arrived = round((gap + 0.0045) / speed / 0.01)
    for one in (sim, other):
        one.advance(arrived - 100 - 3)
    assert asleep(sim) == list(range(10))
    for one in (sim, other):
        one.advance(6)
    assert asleep(sim) == []
    assert sim.bottles().vx == pytest.approx(other.bottles().vx, abs=2e-3)
    sim.advance(300)
    assert asleep(sim) == list(range(11))
    assert forces_on(sim, "stop") == pytest.approx(11 * DRAG, rel=1e-3)


def test_a_bottle_that_passes_wakes_none() -> None:
    """It comes within a millimetre of a sleeper that rests on the floor, and its straight way touches none."""
    sim = run(
        belts={"belt": belt(0.3, (-3.0, 0.05), 6.0, 0.5)},
        floor={"friction": 0.4},
        bottles=[bottle(0.0, 0.0), bottle(-0.5, 0.1315, 0.3)],
    )
    sim.advance(60)
    assert asleep(sim) == [0]
    for _ in range(200):
        sim.advance()
        assert asleep(sim) == [0]
    assert sim.bottles().x[1] > 0.2
    assert sim.bottles().x[0] == 0.0


def test_a_removal_wakes_the_file_which_closes_the_gap() -> None:
    sim = sleeping_file(10)
    sim.delete(4)
    sim.advance(2)
    assert asleep(sim) == []
    sim.advance(300)
    assert len(asleep(sim)) == 9
    assert forces_on(sim, "stop") == pytest.approx(9 * DRAG, rel=1e-3)
    gaps = -np.diff(np.sort(sim.bottles().x)[::-1])
    assert gaps == pytest.approx(0.13, abs=1e-4)


@pytest.mark.parametrize("change", ["position", "velocity", "type"])
def test_an_edit_wakes_the_file(change: str) -> None:
    sim = sleeping_file(3)
    with sim.editing() as (bottles, slots):
        if change == "position":
            bottles.x[slots[2]] -= 0.002
        elif change == "velocity":
            bottles.vx[slots[2]] = -0.1
        else:
            bottles.id[slots[2]] = sim._state.next_id
            sim._state.next_id += 1
    sim.advance(1)
    assert asleep(sim) == []
    sim.advance(150)
    assert len(asleep(sim)) == 3
    assert forces_on(sim, "stop") == pytest.approx(3 * DRAG, rel=1e-3)


def test_a_contact_that_changes_wakes_the_file() -> None:
    """A bottle creeps up too slowly for an impact, and presses once it touches."""
    slow = 0.003
    given = file_of(5)
    given["belts"] = {"belt": belt(slow, (-3.0, -0.5), 4.0, 1.0)}
    for one in given["bottles"]:
        one["velocity"] = [slow, 0.0]
    given["bottles"].append(bottle(-0.065 - 0.0005 - 5 * 0.1305 - 0.009, 0.0, slow))
    sim = run(16, 2, **given)
    sim.advance(240)
    assert asleep(sim) == list(range(5))
    before = forces_on(sim, "stop")
    counts = []
    for _ in range(200):
        sim.advance()
        counts.append(len(asleep(sim)))
    assert 0 in counts
    sim.advance(300)
    assert asleep(sim) == list(range(6))
    assert forces_on(sim, "stop") == pytest.approx(1.2 * before, rel=2e-3)


def test_a_queue_before_a_gate_wakes_when_the_gate_opens() -> None:
    """Bottles near the gate are awake, those behind sleep; after it has opened, the belt carries all away."""
    gate = {"kind": "slide", "from": [0.0, -0.1], "to": [0.0, 0.1], "material": "steel", "direction": 0.5 * np.pi,
            "stroke": 0.4, "max_speed": 2.0, "acceleration": 20.0}  # fmt: skip
    lanes = segment((-3.0, 0.3), (-2.9, 0.3))
    given = file_of(12)
    given["rails"] = {"lane": lanes}
    sims = run(16, 2, gates={"gate": gate}, **given), awake_run(16, 2, gates={"gate": gate}, **given)
    for sim in sims:
        sim.advance(400)
    assert asleep(sims[0]) == list(range(asleep(sims[0])[0], 12))
    assert 8 <= len(asleep(sims[0])) < 12
    for sim in sims:
        sim.command(["gates/gate/open"], [1.0])
        sim.advance(100)
    assert asleep(sims[0]) == []
    np.testing.assert_allclose(sims[0].bottles().x, sims[1].bottles().x, rtol=0.0, atol=2e-3)
    assert sims[0].bottles().x[0] > 0.1
