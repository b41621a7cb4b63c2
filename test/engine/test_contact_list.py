# SPDX-License-Identifier: Apache-2.0
"""The list of contacts agrees with the forces that act."""

import math

import numpy as np
import pytest
from scenes import RADIUS, bottle, contact, line, scene, segment, simulation
from worlds import FAR, evaluate, state_of

from conveyor_sim.simulation import Simulation


def test_listed_forces_sum_up_to_the_forces_that_act() -> None:
    """Per bottle, contacts plus base friction are the load of the force evaluation; moments likewise."""
    # Leapfrog uses the belt's velocity at mid-step; here it is computed for the present positions.
    sim = simulation(**line(accuracy={"per_tick": 50, "integrator": "semi_implicit_euler"}))
    sim.command(["belts/end/cmd_speed", "belts/feeder/cmd_speed"], [0.05, 0.8])
    met = {0: 0, 1: 0}
    for tick in range(300):
        if tick % 60 == 0:
            sim.command(["belts/feeder/cmd_speed"], [0.8])
        sim.advance()
        if tick >= 150 and tick % 5 == 0:
            assert_listed_forces_act(sim)
            for kind in sim.contacts().kind.tolist():
                met[kind] += 1
    assert min(met.values()) > 20


def assert_listed_forces_act(sim: Simulation) -> None:
    world, model = sim._state.world, sim.model
    evaluate(world)
    contacts, state = sim.contacts(), sim.bottles()
    slot = {int(id_): s for s, id_ in enumerate(world.bottles.id) if id_ >= 0}
    fx, fy, moment = (np.zeros(world.bottles.id.size) for _ in range(3))
    for c in range(contacts.kind.size):
        n = np.array([contacts.nx[c], contacts.ny[c]])
        force = -contacts.normal_force[c] * n + contacts.tangential_force[c] * np.array([-n[1], n[0]])
        ends = [(int(contacts.a[c]), 1.0)] + ([(int(contacts.b[c]), -1.0)] if contacts.kind[c] == 0 else [])
        for id_, sign in ends:
            s = slot[id_]
            arm = np.array([contacts.x[c] - world.bottles.x[s], contacts.y[c] - world.bottles.y[s]])
            fx[s] += sign * force[0]
            fy[s] += sign * force[1]
            moment[s] += sign * (arm[0] * force[1] - arm[1] * force[0])
    surface = world.surface
    assert surface is not None
    for id_, vx, vy, type_, belt in zip(state.id, state.vx, state.vy, state.type, state.belt, strict=True):
        s = slot[int(id_)]
        ux, uy = surface.ux[belt], surface.uy[belt]
        if belt >= 0 and surface.turn is not None:
            ux -= surface.turn[belt] * world.bottles.y[s]
            uy += surface.turn[belt] * world.bottles.x[s]
        slip = np.array([vx - ux, vy - uy])
        speed, limit = math.hypot(*slip), model.settings.slip_limit
        share = (2.0 - speed / limit) / limit if speed < limit else 1.0 / speed
        pull = -surface.friction[belt, type_] * model.type_mass[type_] * 9.81 * share * slip
        fx[s] += pull[0]
        fy[s] += pull[1]
    np.testing.assert_allclose(fx, world.load.fx, atol=1e-12)
    np.testing.assert_allclose(fy, world.load.fy, atol=1e-12)
    np.testing.assert_allclose(moment, world.spin.moment, atol=1e-12)


def test_newtons_third_law_in_the_sums() -> None:
    """With contacts among bottles alone, the loads of all bottles add up to zero."""
    rng = np.random.default_rng(1)
    fields = {"contacts": [contact(5000.0, damping=("paper", 1.0), friction=0.3)], "floor": "none"}
    count = 200
    state = state_of(
        scene(bottles=[bottle(FAR, FAR), bottle(-FAR, FAR)], **fields),
        rng.uniform(-0.8, 0.8, (count, 2)),
        rng.normal(0.0, 1.0, (count, 2)),
        rng.normal(0.0, 10.0, count),
    )
    evaluate(state.world)
    load = state.world.load
    size = np.hypot(load.fx, load.fy).sum()
    assert size > 1e4
    # Each sum of n numbers is rounded n times.
    assert abs(load.fx.sum()) < 1e-15 * count * size
    assert abs(load.fy.sum()) < 1e-15 * count * size
    assert abs((state.world.bottles.x * load.fy - state.world.bottles.y * load.fx + state.world.spin.moment).sum()) < (
        1e-15 * count * size
    )


def test_a_contact_of_two_bottles() -> None:
    """Entries: the point in the middle of the overlap, the normal from a to b, N = k delta, T."""
    gap = np.array([0.6, 0.8]) * (2.0 * RADIUS - 0.004)
    fields = {"contacts": [contact(5000.0, friction=0.3)], "floor": "none"}
    state = state_of(
        scene(bottles=[bottle(FAR, FAR), bottle(-FAR, FAR)], **fields),
        [(1.0, 2.0), tuple(np.array([1.0, 2.0]) + gap)],
        [(0.0, 0.0), (-0.8, 0.6)],
    )
    sim = Simulation(scene(bottles=[bottle(FAR, FAR), bottle(-FAR, FAR)], **fields))
    sim._state = state
    listed = sim.contacts()
    assert listed.kind.tolist() == [0]
    assert (listed.a[0], listed.b[0]) == (0, 1)
    middle = np.array([1.0, 2.0]) + np.array([0.6, 0.8]) * (RADIUS - 0.002)
    np.testing.assert_allclose([listed.x[0], listed.y[0]], middle)
    np.testing.assert_allclose([listed.nx[0], listed.ny[0]], [0.6, 0.8])
    assert listed.overlap[0] == pytest.approx(0.004)
    assert listed.normal_force[0] == pytest.approx(20.0)
    # b moves along t = (-0.8, 0.6) and drags a along.
    assert listed.tangential_force[0] == pytest.approx(0.3 * 20.0)


def test_a_contact_of_a_bottle_and_a_rail() -> None:
    """b is the rail's index; the point is the rail's nearest; T on the bottle opposes its slip along (-ny, nx)."""
    fields = {
        "contacts": [contact(5000.0, "steel", friction=0.3)],
        "floor": "none",
        "rails": {"other": segment((5.0, 5.0), (6.0, 5.0)), "rail": segment((-1.0, -1.0), (1.0, -1.0))},
        "bottles": [bottle(FAR, FAR)],
    }
    sim = Simulation(scene(**fields))
    sim._state = state_of(scene(**fields), [(0.3, -1.0 + RADIUS - 0.002)], [(0.7, 0.0)])
    listed = sim.contacts()
    assert (listed.kind.tolist(), listed.a.tolist(), listed.b.tolist()) == ([1], [0], [1])
    place = [listed.x[0], listed.y[0], listed.nx[0], listed.ny[0]]
    np.testing.assert_allclose(place, [0.3, -1.0, 0.0, -1.0], atol=1e-12)
    assert listed.normal_force[0] == pytest.approx(10.0)
    # The tangent is (1, 0): friction retards the bottle.
    assert listed.tangential_force[0] == pytest.approx(-3.0)


def test_more_contacts_than_the_first_room() -> None:
    """The list is as long as necessary, in the order of pairs, and reading it changes nothing."""
    fields = {"contacts": [contact(5000.0, friction=0.3)], "floor": "none"}
    origin = {"type": "bottle", "origin": [0.0, 0.0], "rows": 12, "columns": 12, "pitch": 2.0 * RADIUS - 5e-10}
    sim = Simulation(scene(bottles=[{"grid": origin}], **fields))
    listed = sim.contacts()
    assert listed.kind.size == 2 * 12 * 11
    assert np.all(np.diff(listed.a.astype(int) * 1000 + listed.b.astype(int)) > 0)
    np.testing.assert_array_equal(listed.normal_force, sim.contacts().normal_force)
