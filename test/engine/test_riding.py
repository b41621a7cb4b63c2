# SPDX-License-Identifier: Apache-2.0
"""Riding bottles are not stepped. Nothing else differs: no bit of any observation, and none after they wake."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import COMMON, RADIUS, base, belt, bottle, contact, kind, scene, segment, with_bends

from conveyor_sim.engine.arrays.riding import Riding
from conveyor_sim.engine.compiler.compile import kernel
from conveyor_sim.engine.lists.riding import LEAST, STEPPED, _plan, skipped_slots
from conveyor_sim.engine.threads.workers import UNIT
from conveyor_sim.errors import SimulationError
from conveyor_sim.scene import Scene, parse_scene
from conveyor_sim.simulation import Simulation

SPEED = 0.5
ROWS, COLUMNS, PITCH = 2, 6, 0.2
ROW = {"grid": {"type": "bottle", "origin": [0.0, 0.0], "rows": ROWS, "columns": COLUMNS, "pitch": PITCH}}
"""A dozen bottles without contacts, in adjacent slots."""

Act = Callable[[Simulation], None]


SPRING = {"stiffness": 1e3, "damping": 0.5}
TABLE = {"kind": "curved", "centre": [0.0, 5.0], "inner_radius": 0.5, "width": 2.0, "start_angle": 0.0,
         "span": "360 deg", "material": "chain", "speed": 0.5}  # fmt: skip


def plant(*bottles: dict[str, Any], **more: Any) -> Scene:
    """Return a belt with the dozen and one behind it; a rail, an open gate, a source and a sink out of their way.

    All have one of everything, so that the scenes share their kernels.
    """
    steel = {"material": "steel", "max_speed": 1.0, "acceleration": 10.0}
    base_fields: dict[str, Any] = {
        "accuracy": {"per_tick": 50},
        "bottle_types": {"bottle": kind(contact_height=0.1, gravity_height=0.08, base_radius=0.04)},
        "contacts": [
            contact(5e3, damping=("normal", 1.0), friction=0.1, tangential=SPRING),
            contact(8e3, "steel", ("normal", 1.0), friction=0.1, tangential=SPRING),
        ],
        "base": base(0.4),
        "belts": {
            "main": belt(SPEED, (-1.0, -1.0), 4.0, 2.0, drive={"acceleration": 2.0}),
            "next": belt(0.7, (3.0, -1.0), 2.0, 2.0),
            "table": TABLE,
        },
        "rails": {"stop": segment((4.9, -1.0), (4.9, 1.0))},
        "gates": {"gate": {"kind": "slide", "from": [2.0, -0.3], "to": [2.0, 0.5], "direction": "90 deg",
                           "stroke": 1.5, "open": True, **steel}},
        "machines": {
            "source": {"kind": "source", "bottle": "bottle", "position": [-0.7, -0.7], "direction": 0.0, "speed": SPEED,
                       "rate": 2.0},
            "sink": {"kind": "sink", "region": [[1.2, -0.9], [1.4, -0.9], [1.4, 0.4], [1.2, 0.4]], "rate": 1.0},
        },
        "bottles": [ROW, *bottles],
        "outputs": {"ledger": 100, "damage": 100, "bottles": 50},
        "limits": {"tipping": 0.5},
        "effects": COMMON,
    }  # fmt: skip
    return scene(**with_bends({**base_fields, **more}))


def stepped(tested: Scene, **more: Any) -> Simulation:
    """Return the same scene without riding."""
    return Simulation(parse_scene(tested.source_text, "stepped", {"effects": {"riding": "off"}}), threads=1, **more)


def riders(sim: Simulation) -> set[int]:
    """Return the ids of the bottles that the last step of the last tick skipped; on one thread."""
    world = sim._state.world
    return set(world.bottles.id[skipped_slots(world.riding, world.bottles.id.size)].tolist()) - {-1}


def everything(sim: Simulation) -> list[bytes]:
    """Return everything that can be observed, bit for bit."""
    columns = [*vars(sim.bottles()).values(), *vars(sim.contacts()).values(), *vars(sim.belts()).values()]
    for asked in (sim.damage(), sim.rail_wear()):
        columns += [] if asked is None else list(vars(asked).values())
    reports = (sim.ledger(), sim.counts, sim.integration.deepest_overlap, sim.take_events())
    return [*(np.asarray(column).tobytes() for column in columns), sim.signals().tobytes(), repr(reports).encode()]


def run(tested: Scene, ticks: int, act: Act = lambda sim: None, **more: Any) -> tuple[Simulation, list[set[int]]]:
    """Run with and without riding, and compare at every tick. act: called before a tick.

    Return the riding run at its end, and the riding bottles at each tick.
    """
    riding, plain = Simulation(tested, threads=1, **more), stepped(tested, **more)
    assert riding.model.has("riding")
    assert plain._state.world.riding is None
    rode = []
    for _ in range(ticks):
        for sim in (riding, plain):
            act(sim)
            sim.advance()
        assert everything(riding) == everything(plain)
        assert riding.state_hash() == plain.state_hash()
        rode.append(riders(riding))
    return riding, rode


def by(rode: list[set[int]], tick: int) -> int:
    """Return the number of bottles that rode at once in the last ticks before one; right after a rebuild none does."""
    return max(map(len, rode[max(0, tick - 5) : tick]))


def at(tick: int, act: Act) -> Act:
    """Return an action before one tick."""
    return lambda sim: act(sim) if sim.tick == tick else None


def test_who_is_as_fast_as_its_belt_rides_until_something_comes() -> None:
    """Set down at rest they slide at first, and then all ride; the first ones reach the sink, which removes two."""
    sim, rode = run(plant(machines={}), 150)
    assert by(rode, 6) == 0
    assert by(rode, 150) == ROWS * COLUMNS
    assert (sim.bottles().vx == sim.bottles().vx[0]).all()
    np.testing.assert_allclose(sim.bottles().vx, SPEED, rtol=1e-12)


LEAN: dict[str, Any] = {
    "bottle_types": {"bottle": kind()},
    "contacts": [
        contact(5e3, damping=("normal", 1.0), friction=0.1),
        contact(8e3, "steel", ("normal", 1.0), friction=0.1),
    ],
    "gates": {},
    "outputs": {"ledger": 100, "bottles": 50},
    "limits": {},
}
"""Fields of a plant without tipping, scuffing, springs, rings and gates, with the kernels of test_resting_load.py."""


@pytest.mark.parametrize(
    ("integrator", "solver", "more"),
    [("leapfrog", "explicit", {}), ("velocity_verlet", "implicit", LEAN)],
    ids=["leapfrog-explicit", "velocity_verlet-implicit"],
)
def test_a_whole_line_is_the_same_to_the_bit(integrator: str, solver: str, more: dict[str, Any]) -> None:
    """Bottles come and go, pass to a slower belt, queue at a stop, and meet a gate.

    Work of belts, peaks, scuffing and tipping, which every step adds up, continue while bottles ride.
    """
    gate = "gates" not in more

    def act(sim: Simulation) -> None:
        if gate and sim.tick == 200:
            sim.command(["gates/gate/open"], [0.0])
        if gate and sim.tick == 500:
            sim.command(["gates/gate/open"], [1.0])
        if sim.tick == 500:
            sim.command(["belts/main/cmd_speed"], [0.7])

    tested = plant(accuracy={"per_tick": 50, "integrator": integrator}, friction_solver=solver, **more)
    sim, rode = run(tested, 900, act)
    assert sum(len(ids) for ids in rode) > 0.3 * 900 * 10
    assert (sim.counts.fed > 10, sim.counts.removed > 4) == (True, True)
    assert sim.integration.deepest_overlap > 0.0


# ---------------------------------------------------------------- woken

RIDE = 60
"""Ticks after which the dozen ride."""


def meets(sim: Simulation) -> bool:
    """Return True if anything touches anything."""
    return sim.contacts().kind.size > 0


def test_woken_by_a_bottle_that_runs_into_them() -> None:
    """A bottle thrown across the belt comes within reach of one row after the other."""

    def throw(sim: Simulation) -> None:
        with sim.editing() as (bottles, slots):
            bottles.vy[slots[-1]], bottles.vx[slots[-1]] = -3.0, 3.0

    struck, rode = run(plant(bottle(-0.4, 0.9), machines={}), RIDE + 60, at(RIDE, throw))
    assert by(rode, RIDE) == ROWS * COLUMNS + 1
    assert by(rode, RIDE + 30) < ROWS * COLUMNS
    assert struck.integration.deepest_overlap > 0.0


def test_woken_by_a_rail_in_their_way() -> None:
    sim, rode = run(plant(rails={"stop": segment((1.6, -1.0), (1.6, 1.0))}, machines={}), 200)
    assert meets(sim)
    assert by(rode, 60) == ROWS * COLUMNS
    assert by(rode, 200) < ROWS * COLUMNS


def test_woken_by_the_edge_of_their_belt() -> None:
    """On the next belt they accelerate, and ride again once the spin from the edge is gone."""
    belts = {"main": belt(SPEED, (-1.0, -1.0), 4.0, 2.0), "next": belt(0.7, (3.0, -1.0), 4.0, 2.0), "table": TABLE}
    sim, rode = run(plant(belts=belts, rails={"stop": segment((6.9, -1.0), (6.9, 1.0))}, machines={}), 720)
    assert sim.bottles().x.min() > 3.0
    assert by(rode, RIDE) == by(rode, 720) == ROWS * COLUMNS
    assert by(rode, 550) < ROWS * COLUMNS
    np.testing.assert_allclose(sim.bottles().vx, 0.7, rtol=1e-12)


def test_woken_by_a_belt_that_changes_its_speed() -> None:
    def faster(sim: Simulation) -> None:
        sim.command(["belts/main/cmd_speed"], [0.8])

    sim, rode = run(plant(machines={}), RIDE + 50, at(RIDE, faster))
    assert by(rode, RIDE) == by(rode, RIDE + 50) == ROWS * COLUMNS
    assert not rode[RIDE]
    np.testing.assert_allclose(sim.bottles().vx, 0.8, rtol=1e-12)


def test_woken_by_a_fault() -> None:
    """The drive trips, and the belt stops on its ramp."""
    sim, rode = run(plant(machines={}), RIDE + 150, at(RIDE, lambda sim: sim.inject("belts/main/trip", 1.0)))
    assert by(rode, RIDE) == by(rode, RIDE + 150) == ROWS * COLUMNS
    assert not rode[RIDE]
    assert not sim.bottles().vx.any()


def test_woken_by_a_gate_that_closes_before_them() -> None:
    def close(sim: Simulation) -> None:
        sim.command(["gates/gate/open"], [0.0])

    sim, rode = run(plant(machines={}), RIDE + 250, at(RIDE, close))
    assert by(rode, RIDE) == ROWS * COLUMNS
    assert meets(sim)
    # No bottle rides near any position of the gate, long before it is there.
    assert by(rode, RIDE + 250) == 0


def test_woken_by_bottles_that_are_put_down_beside_them_and_taken_away() -> None:
    """A source faster than the belt puts bottles within reach of earlier ones; a sink removes some."""
    machines = {
        "source": {"kind": "source", "bottle": "bottle", "position": [-0.7, 0.0], "direction": 0.0, "speed": 1.0,
                   "rate": 3.0},
        "sink": {"kind": "sink", "region": [[1.6, -0.9], [2.4, -0.9], [2.4, 0.4], [1.6, 0.4]], "rate": 2.0},
    }  # fmt: skip
    sim, rode = run(plant(machines=machines), 500)
    assert sim.counts.fed > 8
    assert sim.counts.removed > 4
    assert max(map(len, rode)) >= ROWS * COLUMNS


def test_woken_by_an_edit_from_outside() -> None:
    def shove(sim: Simulation) -> None:
        with sim.editing() as (bottles, slots):
            bottles.vx[slots[3]] += 1.2
            bottles.y[slots[7]] += 0.01

    sim, rode = run(plant(machines={}), RIDE + 40, at(RIDE, shove))
    assert by(rode, RIDE) == ROWS * COLUMNS
    assert 3 not in rode[RIDE]
    assert sim.integration.deepest_overlap > 0.0


def test_woken_by_a_restored_checkpoint(tmp_path: Path) -> None:
    """No bottle rides in the first step of a tick, with or without a checkpoint before it."""
    tested = plant()
    sim, rode = run(tested, RIDE)
    assert by(rode, RIDE) >= LEAST
    sim.save(tmp_path / "riding")
    for threads in (1, 2):
        loaded = Simulation.load(tmp_path / "riding", threads=threads)
        straight = stepped(tested)
        straight.advance(RIDE)
        everything(straight)  # observed once
        for _ in range(60):
            loaded.advance()
            straight.advance()
            assert everything(loaded) == everything(straight)


def test_what_is_not_a_number_is_found_in_the_same_tick() -> None:
    tested, reports = plant(machines={}), []
    for sim in (Simulation(tested, threads=1), stepped(tested)):
        sim.advance(RIDE)
        with sim.editing() as (bottles, slots):
            bottles.vx[slots[5]] = math.nan
        with pytest.raises(SimulationError) as stopped:
            sim.advance(2)
        reports.append((str(stopped.value), sim.tick))
    assert reports[0] == reports[1]


def test_nobody_rides_on_a_belt_that_turns() -> None:
    """There bottles creep outward. Beside it, on a straight one, they ride."""
    round_about = [
        bottle(1.5 * math.cos(angle), 5.0 + 1.5 * math.sin(angle)) for angle in 2.0 * math.pi * np.arange(9) / 9
    ]
    sim, rode = run(plant(*round_about, machines={}), 120)
    assert by(rode, 120) == ROWS * COLUMNS
    assert not set.union(*rode) - set(range(ROWS * COLUMNS))
    assert sim.counts.present == ROWS * COLUMNS + 9


# ---------------------------------------------------------------- runs, divisions, threads


def test_the_division_into_calls_and_threads_leaves_no_trace() -> None:
    """More bottles than a block has, on one and on two threads, whose blocks differ."""
    crowd = {"grid": {"type": "bottle", "origin": [-3.0, -3.0], "rows": 30, "columns": 30, "pitch": 0.15}}
    far = {**TABLE, "centre": [0.0, 9.0]}
    tested = plant(
        bottles=[crowd],
        belts={"main": belt(SPEED, (-4.0, -4.0), 6.5, 8.0), "next": belt(0.7, (2.5, -4.0), 4.0, 8.0), "table": far},
        machines={},
    )
    ticks = 160
    one, two, chunks = Simulation(tested, threads=1), Simulation(tested, threads=2), Simulation(tested, threads=1)
    straight = stepped(tested)
    rode = 0
    for _ in range(ticks):
        one.advance()
        two.advance()
        rode += LEAST <= len(riders(one)) < one.counts.present
    chunks.advance(70)
    chunks.advance(ticks - 70)
    straight.advance(ticks)
    expected = everything(straight)
    for sim in (one, two, chunks):
        assert everything(sim) == expected
    assert rode


def test_lists_made_anew_at_any_moment_leave_no_trace() -> None:
    """A stale list makes the integrator stop after a step, and continue in another call."""

    def spoil(sim: Simulation) -> None:
        if sim.tick % 3 == 0:
            sim._state.world.neighbourhood.stale[0] = 1

    _, rode = run(plant(), 200, spoil)
    assert max(map(len, rode)) >= LEAST


def test_runs_are_all_who_do_not_ride_and_leave_out_only_many_at_once() -> None:
    cut: Any = kernel(_plan.py_func)  # type: ignore[attr-defined]
    random = np.random.default_rng(5)
    for first, end in [(0, 64), (64, 576), (128, 137), (512, 640), (0, 1)]:
        for share in (0.0, 0.3, 0.9, 0.98, 1.0):
            riding = empty(1024)
            riding.rides[:] = random.random(1024) < share
            cut(riding, first, end)
            place, count = first // LEAST, riding.runs[first // UNIT]
            assert not riding.end[place + count :].any()
            steps = np.zeros(1024, bool)
            for begin, stop in zip(riding.first[place:][:count], riding.end[place:][:count], strict=True):
                assert not steps[begin:stop].any()
                steps[begin:stop] = True
            assert not steps[:first].any()
            assert not steps[end:].any()
            skipped_slots = ~steps[first:end]
            assert riding.rides[first:end][skipped_slots].all()
            lengths = runs_of(skipped_slots)
            assert all(length >= LEAST for length in lengths)
            # A rider that is stepped has too few adjacent ones.
            assert all(length < LEAST for length in runs_of((riding.rides[first:end] != 0) & ~skipped_slots))


def empty(slots: int) -> Riding:
    """Return room for `slots` bottles."""
    return Riding(
        vx=np.zeros(slots),
        vy=np.zeros(slots),
        omega=None,
        rides=np.zeros(slots, np.int8),
        first=np.zeros(slots // LEAST + 2, np.uint32),
        end=np.zeros(slots // LEAST + 2, np.uint32),
        runs=np.zeros(slots // UNIT + 1, np.int64),
        progress=np.full(slots // UNIT + 1, STEPPED, np.int64),
    )


def runs_of(flags: Any) -> list[int]:
    """Return the lengths of the runs of set flags."""
    padded = np.concatenate([[False], flags, [False]]).astype(int)
    edges = np.flatnonzero(np.diff(padded))
    return (edges[1::2] - edges[::2]).tolist()  # type: ignore[no-any-return]


def test_a_bottle_beside_the_row_is_within_its_reach() -> None:
    """The dozen are too far apart for each other's lists; otherwise the tests above would show little."""
    assert PITCH - 2.0 * RADIUS > 0.2 * RADIUS
