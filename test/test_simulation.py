# SPDX-License-Identifier: Apache-2.0
"""Simulation: the same scene and commands give the same bits, for any division of time and any observers."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from facts import stating
from scenes import MASS, RADIUS, bottle, contact, kind, line, scene, segment, simulation

from conveyor_sim.engine.integrators import RIDES
from conveyor_sim.errors import SimulationError
from conveyor_sim.simulation import Simulation

INTEGRATORS = ["semi_implicit_euler", "velocity_verlet", "dormand_prince"]
TICKS = 300


def little_line(integrator: str = "semi_implicit_euler", **fields: Any) -> Simulation:
    return simulation(**line(accuracy={"per_tick": 50, "integrator": integrator}, **fields))


COMMANDS = {
    40: [{"feeder": 0.7, "end": 0.05}],
    90: [{"bend": -0.1, "feeder": 0.6}, {"side": 99.0}],
    110: [{"bend": 0.8}],
    150: [{"feeder": 0.5}],
    210: [{"feeder": 0.4}],
}
"""Sets of speeds by tick; one is refused, and the feeder's watchdog trips at the end."""


def command(sim: Simulation) -> None:
    """The commands that are due now."""
    for speeds in COMMANDS.get(sim.tick, []):
        sim.command([f"belts/{belt}/cmd_speed" for belt in speeds], list(speeds.values()))


def look(sim: Simulation) -> None:
    """Everything that an observer can ask for."""
    sim.bottles()
    sim.contacts()
    sim.belts()
    sim.signals()
    sim.state_hash()
    assert sim.counts.present >= 0


def run(sim: Simulation, ticks: int = TICKS, chunk: int = 1, watched: bool = False) -> Simulation:
    while sim.tick < ticks:
        command(sim)
        next_command = min(t for t in (*COMMANDS, ticks) if t > sim.tick)
        sim.advance(min(chunk, next_command - sim.tick))
        if watched:
            look(sim)
    return sim


def everything(sim: Simulation) -> list[np.ndarray]:
    """All that can be observed."""
    columns = [*vars(sim.bottles()).values(), *vars(sim.contacts()).values(), *vars(sim.belts()).values()]
    return [*columns, sim.signals()]


def assert_same_bits(one: Simulation, other: Simulation) -> None:
    for a, b in zip(everything(one), everything(other), strict=True):
        np.testing.assert_array_equal(a, b)
    assert one.state_hash() == other.state_hash()
    assert one.counts == other.counts


@pytest.fixture(scope="module", params=INTEGRATORS)
def reference(request: pytest.FixtureRequest) -> Simulation:
    """Return the simulation after one run, tick by tick, without observers."""
    return run(little_line(request.param))


def test_the_little_line_is_busy(reference: Simulation) -> None:
    """The next tests need a line on which much happens."""
    sim = little_line(reference.model.integrator)
    contacts, belts = {0: 0, 1: 0}, set()
    while sim.tick < TICKS:
        command(sim)
        sim.advance()
        for kind_ in sim.contacts().kind.tolist():
            contacts[kind_] += 1
        belts.update(sim.bottles().belt.tolist())
    assert min(contacts.values()) > 150
    assert belts >= {0, 1, 2, 3}
    assert sim.counts.fed > 20
    assert sim.counts.removed > 5
    off = {choice.name for choice in sim.model.effects if not choice.on}
    others = {"hertz", "table", "tsuji_damping", "onset_damping", "atan_friction", "implicit_friction"}
    others |= {"moving_rails", "scuffing", "crushing", "impacts", "tipping"}
    others |= {"static_friction", "vibration", "viscoelastic_damping", "sleeping"}
    others |= set() if sim.model.integrator in RIDES else {"riding"}
    assert off == others | {"tangential_spring", "ring_base", "peaks", "contact_arrays", "energy_ledger"}
    assert [outcome.source for outcome in sim.take_outcomes()][-1] == "watchdog"


def test_the_same_scene_and_commands_give_the_same_bits(reference: Simulation) -> None:
    assert_same_bits(run(little_line(reference.model.integrator)), reference)


@pytest.mark.parametrize("chunk", [7, 1000])
def test_the_division_into_calls_leaves_no_trace(reference: Simulation, chunk: int) -> None:
    assert_same_bits(run(little_line(reference.model.integrator), chunk=chunk), reference)


def test_observers_leave_no_trace(reference: Simulation) -> None:
    assert_same_bits(run(little_line(reference.model.integrator), watched=True), reference)


def test_rebuilds_of_the_lists_leave_no_trace(reference: Simulation) -> None:
    """Lists made anew at every tick, in the middle of it too: a stale list makes the integrator stop after a step."""
    sim = little_line(reference.model.integrator)
    while sim.tick < TICKS:
        command(sim)
        sim._state.world.neighbourhood.stale[0] = 1
        sim.advance()
    assert_same_bits(sim, reference)


def lengthen_lists(sim: Simulation, needed: int) -> None:
    """Lengthen each list as if it had `needed` entries."""
    sim._state._lengthen_lists(needed, needed, needed, needed, needed, needed)
    sim._state.world.neighbourhood.stale[0] = 1
    sim._state.make_lists()


def test_room_for_bottles_and_lists_leaves_no_trace(reference: Simulation) -> None:
    """The reference started with 16 slots and grew; here there is room for all from the start."""
    sim = little_line(reference.model.integrator)
    before = sim._state.world.bottles.id.size
    sim._state._resize(4 * reference._state.world.bottles.id.size)
    lengthen_lists(sim, 20_000)
    assert reference._state.world.bottles.id.size > before
    assert_same_bits(run(sim), reference)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_lists_that_grow_within_a_tick_leave_no_trace(integrator: str) -> None:
    """A bottle slides in one long tick onto a rail of more pieces than its list holds."""

    def sliding() -> Simulation:
        corners = [[-0.4 + 0.0001 * n, 1e-4 * (n % 2)] for n in range(1000)]
        return simulation(
            **line(
                tick=0.5,
                accuracy={"per_tick": 2000, "integrator": integrator},
                rails={"left": segment((-1.0, 0.1), (-0.9, 0.1)), "comb": {"kind": "polyline", "points": corners,
                                                                          "material": "steel"}},
                bottles=[bottle(-0.5, 0.0645, 1.0, -0.05), bottle(-0.3, 0.08, 0.6, 0.0)],
                infeeds={},
            )
        )  # fmt: skip

    short, roomy = sliding(), sliding()
    lengthen_lists(roomy, 5000)
    before = short._state.world.near_segments.piece.size
    short.advance()
    roomy.advance()
    assert short._state.world.near_segments.piece.size > before
    assert roomy._state.world.near_segments.piece.size == 10_000
    assert_same_bits(short, roomy)


def test_a_second_process_gives_the_same_bits(reference: Simulation) -> None:
    here = Path(__file__).parent
    code = (
        "from test_simulation import little_line, run\n"
        f"sim = run(little_line({reference.model.integrator!r}), chunk=13)\n"
        "print(sim.full_state_hash(), sim.contacts().normal_force.sum().hex())\n"
    )
    found = subprocess.run([sys.executable, "-c", code], cwd=here, capture_output=True, text=True, check=True)
    expected = f"{reference.full_state_hash()} {reference.contacts().normal_force.sum().hex()}"
    assert found.stdout.strip() == expected


def test_the_seed_decides_the_jitter() -> None:
    assert run(little_line(seed=8), 50).full_state_hash() == run(little_line(seed=8), 50).full_state_hash()
    assert run(little_line(seed=8), 50).state_hash() != run(little_line(seed=9), 50).state_hash()


def test_leapfrog_and_semi_implicit_euler_are_one_where_no_belt_turns() -> None:
    """The velocity of a belt at mid-step matters on turning belts only."""
    straight = {name: belt for name, belt in line()["belts"].items() if belt["kind"] == "straight"}
    one, other = (little_line(integrator, belts=straight) for integrator in ("leapfrog", "semi_implicit_euler"))
    for sim in (one, other):
        sim.advance(TICKS)
    assert one.counts.fed > 20
    assert len(one.contacts().overlap) > 0
    assert one.state_hash() == other.state_hash()
    curved, euler = little_line("leapfrog"), little_line("semi_implicit_euler")
    for sim in (curved, euler):
        sim.advance(TICKS)
    assert curved.state_hash() != euler.state_hash()


def test_the_hash_tells_states_apart() -> None:
    """The hash differs if only the tick, a bottle or a belt differs."""
    one, other = little_line(), little_line()
    assert one.state_hash() == other.state_hash()
    other.command(["belts/side/cmd_speed"], [0.61])
    one.advance()
    other.advance()
    assert one.state_hash() != other.state_hash()
    still = scene(bottles=[bottle(0.0, 0.0)])
    one, other = Simulation(still), Simulation(still)
    other.advance()
    assert one.state_hash() != other.state_hash()


def test_time_counts_whole_ticks() -> None:
    sim = simulation(tick=0.002, bottles=[bottle(0.0, 0.0)])
    assert (sim.tick, sim.time, sim.stamp_ns) == (0, 0.0, 1)
    sim.advance(5)
    assert (sim.tick, sim.stamp_ns) == (5, 10_000_000)
    assert sim.time == pytest.approx(0.01)
    sim.advance(0)
    assert sim.tick == 5


def test_outputs_are_due_at_their_rate() -> None:
    """Every n-th tick from tick 0 on; 0 Hz is never."""
    rates = {"bottles": 50, "poses": 100, "contacts": 25, "belts": 0, "signals": 100}
    sim = simulation(tick=0.01, outputs=rates, bottles=[bottle(0.0, 0.0)])
    due: dict[str, list[int]] = {topic: [] for topic in rates}
    for _ in range(9):
        for topic in rates:
            if sim.due(topic):
                due[topic].append(sim.tick)
        sim.advance()
    assert due == {
        "bottles": [0, 2, 4, 6, 8], "poses": list(range(9)), "contacts": [0, 4, 8], "belts": [],
        "signals": list(range(9)),
    }  # fmt: skip


def test_initial_bottles_are_as_the_scene_says() -> None:
    """Position, velocity, angle and spin; ids in the scene's order, none on a belt."""
    sim = simulation(
        contacts=[contact(1000.0, friction=0.1)],
        bottles=[bottle(0.1, 0.2, 0.3, -0.4, angle="90 deg", spin=2.0), bottle(1.0, 1.0)],
    )
    state = sim.bottles()
    assert [column[0] for column in (state.id, state.x, state.y, state.vx, state.vy)] == [0, 0.1, 0.2, 0.3, -0.4]
    assert state.theta[0] == pytest.approx(np.pi / 2)
    assert state.omega[0] == 2.0
    assert list(state.belt) == [-1, -1]
    sim.advance()
    assert sim.bottles().theta[0] == pytest.approx(np.pi / 2 + 2.0 * 0.01)


def test_a_bottle_keeps_its_angle_where_nothing_turns_it() -> None:
    sim = simulation(bottles=[bottle(0.1, 0.2, angle=1.0)])
    assert sim.bottles().theta[0] == 1.0
    sim.advance(3)
    assert sim.bottles().theta[0] == 1.0


def test_a_time_step_that_blows_up_is_told() -> None:
    """A force beyond what a double holds, from a contact that the step is far too long for: no silent NaN."""
    sim = simulation(
        tick=0.1,
        accuracy={"per_tick": 1},
        bottle_types={"bottle": kind(mass=1e-9)},
        contacts=[contact(1e20, "steel")],
        rails={"rail": segment((2.0 * RADIUS, -1.0), (2.0 * RADIUS, 1.0))},
        floor="none",
        bottles=[bottle(0.0, 0.0, 1.0)],
    )
    with pytest.raises(SimulationError, match=stating("bottle 0", "tick", "0 s", "steps", "64 times")):
        sim.advance(5)


def test_counts_and_mass_are_kept() -> None:
    """Every bottle fed or there at the start is present or removed; ids are not used twice."""
    sim = little_line()
    start = sim.counts.present - sim.counts.fed
    seen: dict[int, int] = {}
    for _ in range(TICKS):
        command(sim)
        sim.advance()
        counts = sim.counts
        assert counts.present == start + counts.fed - counts.removed
        state = sim.bottles()
        assert len(set(state.id)) == state.id.size == counts.present
        assert list(state.id) == sorted(state.id)
        for id_, type_ in zip(state.id.tolist(), state.type.tolist(), strict=True):
            assert seen.setdefault(id_, type_) == type_
    assert max(seen) == start + sim.counts.fed - 1
    assert sim.counts.removed > 5
    # Slots are reused: no more than the next power of two of the most that were present.
    assert sim._state.world.bottles.id.size <= 64


def test_signals_follow_the_table() -> None:
    sim = run(little_line(), 100)
    values = dict(zip(sim.process_image.signal_names, sim.signals().tolist(), strict=True))
    state, counts = sim.bottles(), sim.counts
    for index, belt in enumerate(sim.model.belts):
        assert values[f"belts/{belt}/bottles"] == (state.belt == index).sum()
        assert values[f"belts/{belt}/speed"] == sim.belts().actual[index]
    assert values["infeeds/packed/fed"] + values["infeeds/timed/fed"] == counts.fed
    assert values["outfeeds/end/removed"] + values["outfeeds/side/removed"] == counts.removed


def test_a_free_slot_rests_and_takes_the_next_bottle() -> None:
    """Its id does not come back."""
    sim = simulation(bottles=[bottle(0.0, 0.0, 0.1), bottle(1.0, 0.0)], contacts=[contact(1000.0)])
    sim._state.remove(0)
    sim._state.make_lists()
    sim.advance(10)
    assert sim.bottles().id.tolist() == [1]
    assert sim._state.add(0, 0.5, 0.5, 0.0, 0.0, 0.0, 0.0) == 2
    assert sim._state.world.bottles.id[0] == 2
    assert sim._state.world.bottles.weight[0] == pytest.approx(MASS * 9.81)
