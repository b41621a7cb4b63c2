# SPDX-License-Identifier: Apache-2.0
"""What our engine is compared with does the same work: the same forces on the same packed bottles, and it is packed."""

import numpy as np
import pytest
from numpy.typing import NDArray

from bench import box2d_rival, impulses, lammps_rival, ours, pymunk_rival
from bench.all_pairs import AllPairs
from bench.box2d_rival import Box2D
from bench.discs import Discs, largest_overlap
from bench.half_list import HalfList
from bench.lammps_rival import Lammps
from bench.packed import DT, FRICTION, GRAVITY, MASS, RADIUS, box_for, table
from bench.pymunk_rival import Pymunk
from conveyor_sim.simulation import Simulation

COUNT = 60
Rival = AllPairs | HalfList


@pytest.fixture(scope="module")
def simulation() -> Simulation:
    """The dense table, packed."""
    return ours.packed(table(COUNT, "minimal"), settle=0.3, threads=1)


@pytest.fixture(scope="module")
def start(simulation: Simulation) -> ours.PackedState:
    """What the rivals begin with."""
    return ours.state_of(simulation, box_for(COUNT))


def contact_forces(simulation: Simulation) -> NDArray[np.float64]:
    """By bottle, (2, N), N; without friction they act along the normal."""
    contacts, forces = simulation.contacts(), np.zeros((2, COUNT))
    pairs = contacts.kind == 0
    push = contacts.normal_force * np.array([contacts.nx, contacts.ny])
    for axis in (0, 1):
        np.subtract.at(forces[axis], contacts.a.astype(int), push[axis])
        np.add.at(forces[axis], contacts.b[pairs].astype(int), push[axis, pairs])
    return forces


@pytest.mark.parametrize("rival", [AllPairs, HalfList])
def test_forces_are_those_of_our_engine(simulation: Simulation, start: ours.PackedState, rival: type[Rival]) -> None:
    """To rounding: overlaps are differences of numbers near 1 m, times 1e4 N/m, so 1e-11 N."""
    ours_now = contact_forces(simulation)
    assert np.abs(ours_now).max() > FRICTION * MASS * GRAVITY  # more than one bottle's pull: it is pressed
    np.testing.assert_allclose(rival(start).contact_forces(), ours_now, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("rival", [AllPairs, HalfList])
def test_steps_are_those_of_our_engine(start: ours.PackedState, rival: type[Rival]) -> None:
    """One tick on, belt included: 250 roundings of 1e-16 m, a few times amplified."""
    engine = ours.packed(table(COUNT, "minimal"), settle=0.3, threads=1)
    engine.advance(1)
    other = rival(start)
    other.contestant().work(engine.model.steps_per_tick)
    bottles = engine.bottles()
    assert engine.model.dt == DT
    for name, tolerance in (("x", 1e-12), ("y", 1e-12), ("vx", 1e-10), ("vy", 1e-10)):
        np.testing.assert_allclose(getattr(other, name), getattr(bottles, name), rtol=0.0, atol=tolerance)


def test_half_list_is_rebuilt_before_a_pair_is_missed(start: ours.PackedState) -> None:
    """A bottle shot through a gap meets pairs that weren't listed at first."""
    far = ours.PackedState(start.box, start.x.copy(), start.y.copy(), start.vx.copy(), start.vy.copy())
    last = int(np.argmin(far.x))
    far.x[last] = 0.1
    far.vx[last] = 5.0
    one, other = HalfList(far), AllPairs(far)
    one.work(2_000)
    other.contestant().work(2_000)
    assert one.x[last] > 0.25  # it has passed the skin many times over
    np.testing.assert_allclose(one.x, other.x, rtol=0.0, atol=1e-9)


def test_lammps_packs_as_densely() -> None:
    """Its belt differs, its packing should not: nearly as many contacts, though ours, undamped, open now and then."""
    if absent := lammps_rival.why_not():
        pytest.skip(absent)
    count = 400
    engine = ours.packed(table(count, "minimal"), settle=1.2, threads=1)
    rival = Lammps(ours.state_of(engine, box_for(count)))
    assert rival.contacts_per_bottle() > 1.5
    assert rival.contacts_per_bottle() == pytest.approx(ours.contacts_per_bottle(engine), rel=0.25)
    rival.close()


def test_largest_overlap_is_that_of_the_deepest_contact() -> None:
    """The largest overlap is that of two bottles, or of one and a wall; it is 0 where all are apart."""
    box, r = box_for(COUNT), RADIUS
    apart = np.array([[2.0 * r, 2.0 * r], [5.0 * r, 2.0 * r], [2.0 * r, 5.0 * r]])
    assert largest_overlap(apart, box) == 0.0
    pair = np.vstack([apart, [2.0 * r, 3.99 * r]])
    assert largest_overlap(pair, box) == pytest.approx(0.99 * r, rel=1e-12)  # with the third
    wall = np.vstack([apart, [box.length - 0.5 * r, 8.0 * r]])
    assert largest_overlap(wall, box) == pytest.approx(0.5 * r, rel=1e-12)


def test_largest_overlap_is_that_of_the_engine() -> None:
    engine = ours.packed(impulses.swept(COUNT, 4, 1), settle=0.3, threads=1)
    deepest = engine.contacts().overlap.max()
    state = ours.state_of(engine, box_for(COUNT))
    assert deepest > 0.0
    assert largest_overlap(np.column_stack([state.x, state.y]), state.box) == pytest.approx(deepest, abs=1e-12)


def rigid_rivals(start: ours.PackedState) -> list[Discs]:
    """Box2D and pymunk with one tuning each, as far as they are installed."""
    rivals: list[Discs] = []
    if not box2d_rival.why_not():
        rivals.append(Box2D(start, box2d_rival.TUNINGS[-1]))
    if not pymunk_rival.why_not():
        rivals.append(Pymunk(start, pymunk_rival.TUNINGS[-1]))
    return rivals


def test_rigid_rivals_hold_the_crowd_in_the_box(start: ours.PackedState) -> None:
    """Released from our packing, bottles stay pressed against the end wall, with overlaps below a hundredth of R."""
    rivals = rigid_rivals(start)
    if not rivals:
        pytest.skip(f"{box2d_rival.why_not()}; {pymunk_rival.why_not()}")
    for rival in rivals:
        rival.advance(2.0)
        positions = rival.positions()
        assert positions.shape == (COUNT, 2)
        assert start.box.length - RADIUS - 1e-3 < positions[:, 0].max() < start.box.length - RADIUS + 1e-3
        assert largest_overlap(positions, start.box) < 0.01 * RADIUS
        np.testing.assert_allclose(positions[:, 0].mean(), start.x.mean(), atol=0.2 * RADIUS)


def test_a_rigid_rival_slides_as_the_belt_pulls() -> None:
    """A bottle alone, from rest: half of mu g t^2, to the size of a step."""
    box = box_for(COUNT)
    one = np.array([4.0 * RADIUS]), np.array([0.5 * box.width]), np.zeros(1), np.zeros(1)
    rivals = rigid_rivals(ours.PackedState(box, *one))
    if not rivals:
        pytest.skip(f"{box2d_rival.why_not()}; {pymunk_rival.why_not()}")
    for rival in rivals:
        rival.advance(0.25)
        way = 0.5 * FRICTION * GRAVITY * 0.25**2
        assert rival.positions()[0, 0] - one[0][0] == pytest.approx(way, rel=0.1)
