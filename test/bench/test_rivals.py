# SPDX-License-Identifier: Apache-2.0
"""What our engine is compared with does the same work: the same forces on the same packed bottles, and it is packed."""

import numpy as np
import pytest
from numpy.typing import NDArray

from bench import lammps_rival, ours
from bench.all_pairs import AllPairs
from bench.half_list import HalfList
from bench.lammps_rival import Lammps
from bench.packed import DT, FRICTION, GRAVITY, MASS, box_for, table
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
