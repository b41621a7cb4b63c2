# SPDX-License-Identifier: Apache-2.0
"""The method of impulses: same bits for threads, calls, checkpoints and replays; colours; impulses that are state."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from bag.small_line import record
from facts import stating
from scenes import RADIUS, belt, bottle, kind, polyline, scene
from swept import MU_BASE, crowd, fields, file_of, forces_on, glass, run, swept

from conveyor_sim.accuracy.trajectory import displace
from conveyor_sim.bag.messages.encode import FORMAT
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorded_scene import recorded_scene
from conveyor_sim.bag.replay import replay
from conveyor_sim.engine.arrays.impulses import COLOURS
from conveyor_sim.engine.integrators import INTEGRATORS
from conveyor_sim.engine.threads.workers import UNIT
from conveyor_sim.errors import CheckpointError
from conveyor_sim.physics.state.empty_world import empty_pairs
from conveyor_sim.physics.stepping.guard.guard import OVERLAP
from conveyor_sim.physics.stepping.guard.violation import unresolved
from conveyor_sim.scene import parse_scene
from conveyor_sim.scene.recorded import expanded_text
from conveyor_sim.simulation import Simulation


def pressed_crowd(threads: int = 1) -> Simulation:
    """Return 240 bottles of two sizes, which a belt presses into a corner."""
    return Simulation(scene(**crowd(16, 15)), threads=threads)


def test_bits_depend_neither_on_threads_nor_on_calls_nor_on_checkpoints(tmp_path: Path) -> None:
    one = pressed_crowd()
    one.advance(150)
    assert one._state.world.pairs is not None
    assert one._state.world.pairs.impulse is not None
    # Colours have several units, so each thread has a share.
    assert np.diff(one._state.world.pairs.impulse.start).max() > UNIT
    assert one.contacts().kind.size > 200
    for threads, calls in ((2, (150,)), (3, (1, 60, 89))):
        other = pressed_crowd(threads)
        for ticks in calls:
            other.advance(ticks)
        assert other.full_state_hash() == one.full_state_hash()
        np.testing.assert_array_equal(other.bottles().impulse, one.bottles().impulse)
        np.testing.assert_array_equal(other.bottles().peak_force, one.bottles().peak_force)
    saved = pressed_crowd()
    saved.advance(97)
    saved.save(tmp_path / "there")
    loaded = Simulation.load(tmp_path / "there", threads=2)
    loaded.advance(53)
    assert loaded.full_state_hash() == one.full_state_hash()


def test_peaks_change_no_bit() -> None:
    """Nor do contacts that are read at every tick."""
    shown, hidden = (
        Simulation(scene(**crowd(6, 5, effects={"peaks": peaks, "rotation": "on", "unequal_radii": "on"})), threads=1)
        for peaks in ("on", "off")
    )
    for _ in range(100):
        shown.advance()
        shown.contacts(), shown.bottles()
    hidden.advance(100)
    assert shown.state_hash() == hidden.state_hash()


def test_one_kind_of_pairs_has_the_bits_of_several() -> None:
    """A type without bottles changes how the constants of a pair are read, and no bit."""
    given = file_of(30)
    for n, one in enumerate(given["bottles"]):
        one["position"][1] = 0.01 * math.sin(n)
    alike = run(bottle_types={"bottle": kind()}, **given)
    several = run(**given)
    assert alike._state.world.impulses is not None
    assert (alike._state.world.impulses.alike, several._state.world.impulses.alike) == (1, None)
    for sim in (alike, several):
        sim.advance(200)
    for name in ("x", "y", "vx", "vy", "omega", "impulse"):
        np.testing.assert_array_equal(getattr(alike.bottles(), name), getattr(several.bottles(), name))


@pytest.mark.parametrize("accuracy", ["fast", swept(8, 3)])
def test_a_recording_replays_bit_for_bit(accuracy: Any, tmp_path: Path) -> None:
    given = crowd(6, 5, accuracy=accuracy, outputs={"bottles": 50, "contacts": 50})
    recorded = scene(**given, duration=1.0)
    record(recorded, tmp_path / "bag", 100)
    with open_bag(tmp_path / "bag") as bag:
        assert bag.line.sweeps == recorded.accuracy.sweeps
    report = replay(tmp_path / "bag")
    assert report.difference is None
    assert report.exact
    assert report.compared["contacts"] == 51


def test_a_recording_keeps_its_sweeps_whatever_the_default() -> None:
    """The sweeps of the recorded run replace those that this version would choose for the same text."""
    given = crowd(2, 2, accuracy={"integrator": "impulses", "per_tick": 8})
    text = scene(**given).source_text
    line = SimpleNamespace(
        scene_text=text, overrides="", integrator="impulses", steps_per_tick=8, sweeps=5, format=FORMAT
    )
    assert parse_scene(text).accuracy.sweeps == 2
    assert recorded_scene(line, "bag").accuracy.sweeps == 5


def test_a_checkpoint_does_not_go_on_with_other_sweeps(tmp_path: Path) -> None:
    one, other = (scene(**crowd(6, 5, accuracy=swept(8, sweeps))) for sweeps in (2, 3))
    sim = Simulation(one)
    sim.advance(2)
    sim.save(tmp_path / "there")
    with pytest.raises(CheckpointError, match=stating("accuracy.sweeps", "2", "3")):
        Simulation.load(tmp_path / "there", scene=other)


def test_the_explicit_form_of_a_scene_has_the_same_bits() -> None:
    """`fast` alone, its fields, and the scene written with all values."""
    word, written = (scene(**crowd(6, 5, accuracy=accuracy)) for accuracy in ("fast", swept(8, 2)))
    expanded = parse_scene(expanded_text(word))
    assert expanded.accuracy.sweeps == 2
    hashes = []
    for one in (word, written, expanded):
        sim = Simulation(one)
        sim.advance(60)
        hashes.append(sim.state_hash())
    assert hashes[0] == hashes[1] == hashes[2]


def test_pairs_of_a_colour_share_no_bottle() -> None:
    sim = pressed_crowd()
    sim.advance(100)
    pairs = sim._state.world.pairs
    assert pairs is not None
    assert pairs.impulse is not None
    ordered = pairs.impulse
    assert ordered.start[-1] == pairs.used[0] > 200
    for first, end in zip(ordered.start[:-1], ordered.start[1:], strict=True):
        bottles = np.concatenate([ordered.i[first:end], ordered.j[first:end]])
        assert np.unique(bottles).size == bottles.size
    place = ordered.place[: pairs.used[0]]
    assert np.array_equal(ordered.i[place], pairs.i[: pairs.used[0]])
    assert np.array_equal(np.sort(place), np.arange(pairs.used[0]))


def test_more_neighbours_than_colours() -> None:
    """A large disc pressed by 80 small ones: the last colour takes the rest, and the bits are those of one thread."""
    count, large = 80, 1.0
    radius = 0.9 * math.pi * large / count
    ring = large + radius + 1e-4
    angles = 2.0 * math.pi * np.arange(count) / count
    given = fields(
        bottle_types={"bottle": kind(radius, 0.05), "big": kind(large, 5.0)},
        bottles=[
            bottle(0.0, 0.0, type="big"),
            *(bottle(ring * math.cos(a), ring * math.sin(a), -0.3 * math.cos(a), -0.3 * math.sin(a)) for a in angles),
        ],
    )
    hashes = []
    for threads in (1, 3):
        sim = Simulation(scene(**given), threads=threads)
        assert sim._state.world.pairs is not None
        sim.advance(1)
        assert sim._state.world.pairs.impulse is not None
        start = sim._state.world.pairs.impulse.start
        assert start[COLOURS] - start[COLOURS - 1] > 0
        sim.advance(19)
        hashes.append(sim.full_state_hash())
        state = sim.bottles()
        momentum = sim.model.type_mass[state.type] @ np.column_stack([state.vx, state.vy])
        assert np.abs(momentum).max() < 1e-12
    assert hashes[0] == hashes[1]


def test_rebuilds_list_the_pairs_of_slow_fast_and_new_bottles() -> None:
    """Most rebuilds take pairs from the coarse list. Fast bottles, and new ones in slots, are searched beside it."""
    state, random, spent = pressed_crowd()._state, np.random.default_rng(5), []
    skin = state.model.settings.skin
    for turn in range(60):
        bottles = state.world.bottles
        slots = np.flatnonzero(bottles.id >= 0)
        bottles.x[slots] += random.uniform(-0.05, 0.06, slots.size) * skin
        fast = random.choice(slots, 3, replace=False)
        bottles.y[fast] += random.uniform(-3.0, 3.0, 3) * skin
        if turn % 4 == 0:
            kind, x, y = int(bottles.type[fast[1]]), float(bottles.x[fast[2]]), float(bottles.y[fast[2]])
            state.remove(int(fast[0]))
            state.remove(int(fast[1]))
            state.add(kind, x + skin, y, 0.0, 0.0, 0.0, 0.0)
        speed = random.uniform(0.0, 0.5, bottles.id.size)
        speed[fast] = 4.0, 4.0, 6.0
        angle = random.uniform(0.0, 2.0 * math.pi, bottles.id.size)
        bottles.vx[:], bottles.vy[:] = speed * np.cos(angle), speed * np.sin(angle)
        state.world.neighbourhood.stale[0] = 1
        state.make_lists()
        pairs, coarse, ways = state.world.pairs, state.world.neighbourhood.coarse, state.world.neighbourhood.ways
        assert pairs is not None
        assert coarse is not None
        assert ways is not None
        np.testing.assert_allclose(ways.way, np.minimum(ways.least + ways.time * speed, ways.most), rtol=1e-14)
        assert ways.way.min() < 0.5 * skin < skin < ways.way.max() == ways.most
        spent.append(int(coarse.spent[0]))
        i, j = np.triu_indices(bottles.id.size, 1)
        reach = bottles.radius[i] + bottles.radius[j] + ways.way[i] + ways.way[j]
        near = np.hypot(bottles.x[i] - bottles.x[j], bottles.y[i] - bottles.y[j]) < reach
        near &= (bottles.id[i] >= 0) & (bottles.id[j] >= 0)
        count = int(pairs.used[0])
        np.testing.assert_array_equal(pairs.i[:count], i[near])
        np.testing.assert_array_equal(pairs.j[:count], j[near])
    assert 2 < spent.count(0) < 30


def test_without_room_for_the_coarse_list_all_cells_are_searched() -> None:
    """The cells around a bottle then reach as far as the longest ways."""
    state, random = pressed_crowd()._state, np.random.default_rng(7)
    hood = state.world.neighbourhood
    assert hood.coarse is not None
    short = {name: np.zeros(8, getattr(hood.coarse, name).dtype) for name in ("j", "other", "before")}
    state.world = state.world._replace(neighbourhood=hood._replace(coarse=hood.coarse._replace(**short)))
    for _ in range(5):
        bottles = state.world.bottles
        slots = np.flatnonzero(bottles.id >= 0)
        bottles.x[slots] += random.uniform(-0.3, 0.3, slots.size) * state.model.settings.skin
        bottles.vx[:] = random.uniform(0.0, 0.5, bottles.id.size)
        bottles.vx[random.choice(slots, 9, replace=False)] = 6.0
        state.world.neighbourhood.stale[0] = 1
        state.make_lists()
        pairs, hood = state.world.pairs, state.world.neighbourhood
        assert pairs is not None
        assert hood.coarse is not None
        assert hood.ways is not None
        assert hood.coarse.spent[0] == -1
        i, j = np.triu_indices(bottles.id.size, 1)
        reach = bottles.radius[i] + bottles.radius[j] + hood.ways.way[i] + hood.ways.way[j]
        near = np.hypot(bottles.x[i] - bottles.x[j], bottles.y[i] - bottles.y[j]) < reach
        near &= (bottles.id[i] >= 0) & (bottles.id[j] >= 0)
        count = int(pairs.used[0])
        np.testing.assert_array_equal(pairs.i[:count], i[near])
        np.testing.assert_array_equal(pairs.j[:count], j[near])


def test_lists_that_are_too_short_leave_no_trace() -> None:
    """A call returns where a rebuilt list does not fit; the rest of the tick follows with a longer one."""
    one, other = pressed_crowd(), pressed_crowd()
    state = other._state
    assert state.world.pairs is not None
    shortest = int(state.world.pairs.used[0])
    state.world = state.world._replace(pairs=empty_pairs(state.model, shortest))
    state.world.neighbourhood.stale[0] = 1
    state.make_lists()
    for sim in (one, other):
        sim._state.world.bottles.vx[:] = -3.0
        sim.advance(100)
    assert state.world.pairs is not None
    assert state.world.pairs.i.size > shortest
    assert other.state_hash() == one.state_hash()
    np.testing.assert_array_equal(other.bottles().impulse, one.bottles().impulse)


def resting_file() -> Simulation:
    """Return a file of ten that has come to rest on its stop."""
    sim = run(16, 2, **file_of(10))
    sim.advance(300)
    return sim


def test_forces_survive_a_rebuild_of_the_lists() -> None:
    sim = resting_file()
    before = forces_on(sim, "stop")
    sim._state.world.neighbourhood.stale[0] = 1
    sim._state.make_lists()
    assert forces_on(sim, "stop") == before
    sim.advance(1)
    assert forces_on(sim, "stop") == pytest.approx(before, rel=1e-6)


def test_forces_survive_shorter_steps() -> None:
    """The guard repeats a tick in shorter steps: held impulses are scaled, so that nothing is kicked."""
    sim = resting_file()
    before, speed = forces_on(sim, "stop"), np.abs(sim.bottles().vx).max()
    steps, dt = 4 * sim.model.steps_per_tick, sim.model.dt / 4.0
    sim.integration._pool.advance(1, INTEGRATORS["impulses"], sim._state.world, steps, dt, 0)
    assert forces_on(sim, "stop") == pytest.approx(before, rel=2e-3)
    assert np.abs(sim.bottles().vx).max() < speed + 1e-4


def test_a_bottle_that_is_removed_takes_its_impulses_along() -> None:
    """The next one in its slot starts with none; the file closes the gap."""
    sim = resting_file()
    before = forces_on(sim, "stop")
    sim._state.remove(0)
    sim._state.make_lists()
    assert forces_on(sim, "stop") == 0.0
    warm = sim._state.world.impulses
    assert warm is not None
    assert warm.warm.x[0] == 0.0
    sim.advance(300)
    assert forces_on(sim, "stop") == pytest.approx(0.9 * before, rel=5e-3)


def test_a_bottle_alone_keeps_its_spin_and_rides_the_belt() -> None:
    sim = run(belts={"belt": belt(0.3)}, bottles=[bottle(0.0, 0.0, 0.3, spin=1.7), bottle(1.0, 1.0, type="big")])
    sim.advance(100)
    state = sim.bottles()
    assert state.omega[0] == 1.7
    assert state.vx[0] == pytest.approx(0.3, abs=1e-12)
    assert state.x[0] == pytest.approx(0.3, rel=1e-9)


def test_contacts_list_the_held_forces() -> None:
    """On the second of two bottles: its stop bears both, the contact between them the drag of the one behind."""
    sim = run(16, 2, **file_of(2))
    sim.advance(200)
    contacts = sim.contacts()
    drag = MU_BASE * 0.2 * 9.81
    pair, rail = contacts.kind == 0, contacts.kind == 1
    assert contacts.normal_force[pair] == pytest.approx([drag], rel=1e-3)
    assert contacts.normal_force[rail] == pytest.approx([2.0 * drag], rel=1e-3)
    assert contacts.nx[rail] == pytest.approx([1.0])
    assert contacts.x[rail] == pytest.approx([0.0], abs=1e-4)


def test_a_fast_bottle_does_not_pass_a_rail() -> None:
    """At 5 m/s it moves by a tenth of its radius in a substep; the contact acts before it touches."""
    box = polyline([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)], closed=True)
    sim = run(
        contacts=[glass(restitution=0.99), glass("steel", restitution=0.99)],
        rails={"box": box},
        bottles=[bottle(0.0, 0.1, 4.0, 3.0)],
    )
    for _ in range(200):
        sim.advance()
        state = sim.bottles()
        assert max(abs(state.x[0]), abs(state.y[0])) <= 0.5 - RADIUS + 1e-3


def test_overlaps_of_too_few_sweeps_are_reported_once() -> None:
    """From 0.4 % of the diameter on; with the default steps the crowd stays far below it."""
    found = {}
    for steps, sweeps in ((1, 1), (8, 2)):
        given = crowd(6, 5)
        sim = run(steps, sweeps, **{name: given[name] for name in ("belts", "rails", "bottles")})
        sim.advance(200)
        found[steps] = sim.integration.deepest_overlap, [event.text for event in sim.integration.take_events()]
    coarse, default = found[1], found[8]
    assert coarse[0] > OVERLAP > 4.0 * default[0]
    assert default[1] == [] and len(coarse[1]) == 1
    assert "1 steps a tick with 1 sweep do not resolve" in coarse[1][0]
    assert "overlaps" in coarse[1][0] or "sinks" in coarse[1][0]


def test_a_contact_that_steps_resolve_may_overlap() -> None:
    """A soft spring overlaps by its load: that is no error of the sweeps."""
    soft = [glass(stiffness=2e3), glass("steel", stiffness=2e3)]
    for stiffness, expected in ((soft, False), (fields()["contacts"], True)):
        sim = run(8, 2, **file_of(3) | {"contacts": stiffness})
        assert unresolved(sim.model) is expected


def test_bottles_put_into_each_other_part_as_their_spring_lets_them() -> None:
    """Overlap d, half of 1/2 k d^2 each; exactly coincident ones as well, along x. The guard knows that energy."""
    contacts = [glass(stiffness=1e5, restitution=1.0, friction=0.0), glass("steel")]
    for gap in (RADIUS, 0.0):
        sim = run(400, 2, contacts=contacts, bottles=[bottle(0.0, 0.0), bottle(0.5, 0.0)])
        displace(sim, np.array([0.0, gap - 0.5]), np.zeros(2), np.zeros(2), np.zeros(2))
        sim.advance(1)
        state, mass = sim.bottles(), sim.model.type_mass[0]
        expected = 0.5 * (2.0 * RADIUS - gap) * math.sqrt(2e5 / mass)
        np.testing.assert_allclose(state.vx, [-expected, expected], rtol=0.03)
        assert sim.integration.shortened_ticks == 0


def test_a_step_may_go_a_tenth_of_the_radius() -> None:
    allowed, reported = [], []
    for share in (0.99, 1.01):
        sim = run(1, 1, bottles=[bottle(0.0, 0.0, share * 0.1 * RADIUS / 0.01), bottle(9.0, 0.0)])
        sim.advance(3)
        allowed.append(sim.integration.shortened_ticks == 0)
        reported.append([event.kind for event in sim.integration.take_events()])
    assert allowed == [True, False]
    assert reported[0] == [] and reported[1][0] == "shorter_steps"
