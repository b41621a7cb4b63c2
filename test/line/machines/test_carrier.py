# SPDX-License-Identifier: Apache-2.0
"""Stations that carry several bottles: throughput, order, stops, checkpoints; stations that change the type."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from line.machines.machine_line import line, signals, sink, source, station
from line.machines.test_station import BEFORE, BEHIND, LOADED, RAILS, of, stationed
from scenes import MASS, RADIUS, kind

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.bag.replay import replay
from conveyor_sim.errors import SceneError
from conveyor_sim.line.commands.inputs import SET, Input
from conveyor_sim.line.machines.packml import Command, PackMLState
from conveyor_sim.simulation import Simulation

RINSER: dict[str, Any] = {"rate": 3.0, "capacity": 6, "hold": 2.0}
TYPES = {"bottle": kind(), "full": kind(1.2 * RADIUS, 3.0 * MASS)}


def inside(sim: Simulation) -> list[int]:
    """Return the ids of the bottles in the station, in the order of their arrival."""
    (device,) = [device for device in sim._line._devices if device.name == "machines/capper"]
    return list(device.held)


def moves(sim: Simulation, ticks: int) -> tuple[dict[int, int], dict[int, int]]:
    """Return the ticks at which bottles came into the station and left it, by id, in order."""
    gone: dict[int, int] = {}
    back: dict[int, int] = {}
    for _ in range(ticks):
        before = set(inside(sim))
        sim.advance()
        now = set(inside(sim))
        gone |= dict.fromkeys(now - before, sim.tick)
        back |= dict.fromkeys(before - now, sim.tick)
    return gone, back


@pytest.mark.parametrize(("rate", "capacity", "hold"), [(3.0, 6, 2.0), (2.9, 5, 5 / 2.9), (2.0, 6, 2.0), (3.0, 1, 0.2)])
def test_throughput_of_a_full_station(rate: float, capacity: int, hold: float) -> None:
    """It is the rate, and capacity / hold at most; rate x hold bottles are inside in the mean (Little's law)."""
    sim = stationed(4.0, rate=rate, capacity=capacity, hold=hold)
    sim.advance(1000)
    before, held = of(sim, "processed"), []
    for _ in range(1000):
        sim.advance()
        held.append(of(sim, "held"))
    assert of(sim, "processed") - before == pytest.approx(10.0 * rate, abs=1.0)
    assert max(held) <= capacity == of(sim, "capacity")
    assert np.mean(held) == pytest.approx(rate * hold, abs=0.1)
    assert of(sim, "blocked_time") == 0.0


def test_each_bottle_stays_for_the_time_and_in_the_order() -> None:
    """Lone bottles stay for `hold`, without rounding. In a queue, a tick is the tolerance."""
    gone, back = moves(stationed(0.2, **RINSER), 1500)
    assert len(back) >= 2
    assert {bottle: back[bottle] - gone[bottle] for bottle in back} == dict.fromkeys(back, 200)
    gone, back = moves(stationed(4.0, **{**RINSER, "rate": 2.9}), 2000)
    assert list(back) == list(gone)[: len(back)] == list(range(len(back)))
    assert {back[bottle] - gone[bottle] for bottle in back} <= {199, 200, 201}


def test_without_a_time_it_follows_from_rate_and_capacity() -> None:
    gone, back = moves(stationed(0.2, rate=2.0, capacity=3), 1300)
    assert {back[bottle] - gone[bottle] for bottle in back} == {150}


def test_at_half_the_rate_bottles_stay_for_twice_the_time() -> None:
    sim = stationed(4.0, **RINSER)
    sim.advance(1000)
    sim.command(["machines/capper/rate"], [1.5])
    sim.advance(500)
    gone, back = moves(sim, 900)
    stays = [back[bottle] - gone[bottle] for bottle in back if bottle in gone]
    assert len(stays) > 5
    assert set(stays) <= {399, 400, 401}
    sim.command(["machines/capper/rate"], [0.0])
    sim.advance()
    before = inside(sim)
    sim.advance(500)
    assert inside(sim) == before, "nothing moves"


def test_time_left_counts_down_to_the_return() -> None:
    sim = stationed(0.2, **RINSER)
    while not of(sim, "held"):
        sim.advance()
    assert of(sim, "time_left") == pytest.approx(2.0)
    sim.advance(150)
    assert of(sim, "time_left") == pytest.approx(0.5)
    sim.advance(50)
    assert (of(sim, "held"), of(sim, "holds"), of(sim, "time_left")) == (0.0, 0.0, 0.0)


def test_blocked_it_stops_and_takes_no_more() -> None:
    """The conveyor in it stops, so bottles keep their distances and leave at the rate afterwards."""
    sim = stationed(4.0, **RINSER, suspend_after=0.5)
    sim.inject("machines/packer/stop", 1.0)
    sim.advance(3000)
    assert (of(sim, "blocked"), of(sim, "state"), of(sim, "held")) == (1.0, PackMLState.SUSPENDED, 6.0)
    before = inside(sim)
    sim.advance(200)
    assert inside(sim) == before
    sim.inject("machines/packer/stop", 0.0)
    _, back = moves(sim, 600)
    ticks = list(back.values())
    assert list(back)[:6] == before
    assert min(np.diff(ticks)) >= 33, "at 3 per second"


def test_it_runs_empty_and_is_starved_then() -> None:
    """A failure of the filler empties it: starved only once the last bottle has left."""
    sim = stationed(4.0, **RINSER, suspend_after=0.5)
    sim.advance(1000)
    sim.inject("machines/filler/stop", 1.0)
    while of(sim, "held"):
        assert not of(sim, "starved")
        sim.advance()
    sim.advance(100)
    assert (of(sim, "starved"), of(sim, "state")) == (1.0, PackMLState.SUSPENDED)
    sim.inject("machines/filler/stop", 0.0)
    sim.advance(1000)
    assert of(sim, "held") == 6.0


def test_an_emergency_stop_holds_the_bottles_where_they_are() -> None:
    """They stay inside with their order and the rest of their time, and leave after reset, Clear, Reset and Start."""
    panel = {"estop": {"kind": "emergency_stop", "cuts": ["machines"]}}
    sim = stationed(4.0, **RINSER, panel=panel)
    sim.advance(1000)
    gone, _ = moves(sim, 100)
    before, left = inside(sim), of(sim, "time_left")
    for name, value in (("press", 1.0), ("press", 0.0)):
        sim.give(Input("test", "operator", "operator", SET, (f"panel/estop/{name}",), (value,)))
        sim.advance()
    assert of(sim, "state") == PackMLState.ABORTED
    sim.advance(500)
    assert inside(sim) == before
    assert of(sim, "time_left") == pytest.approx(left, abs=0.02)
    sim.give(Input("test", "operator", "operator", SET, ("panel/estop/reset",), (1.0,)))
    sim.advance()
    for command in (Command.CLEAR, Command.RESET, Command.START):
        sim.command([f"machines/{name}/cntrl_cmd" for name in ("filler", "capper", "packer")], [command] * 3)
        sim.advance()
    _, back = moves(sim, 300)
    assert list(back)[: len(before)] == before
    stops = 500 + 2 + 1 + 3
    assert all(abs(back[bottle] - gone[bottle] - 200 - stops) <= 3 for bottle in before if bottle in gone)


def test_effectiveness_is_1_at_its_rate() -> None:
    """Returned bottles over rate x time running; a cycle that had begun before the reset counts in part."""
    sim = stationed(4.0, **RINSER)
    sim.advance(1010)
    sim.give(Input("test", "shift", "operator", "reset_counters", (), ()))
    for ticks in (300, 700):
        sim.advance(ticks)
        counters = sim.line.counters()
        assert counters is not None
        index = counters.name.index("machines/capper")
        cycles = counters.effectiveness[index] * counters.running[index] * 3.0
        assert cycles == pytest.approx(counters.running[index] * 3.0, abs=1.01)
        assert counters.running[index] == pytest.approx((sim.tick - 1011) * 0.01, abs=0.02)


@pytest.mark.parametrize("threads", [1, 2])
def test_a_run_goes_on_from_a_checkpoint_with_the_same_bits(threads: int, tmp_path: Path) -> None:
    """With several bottles inside, whose type and attributes change."""
    given: dict[str, Any] = {
        **RINSER, "ramp_up": 0.4, "sets": {"clean": {"to": 1.0, "share": 0.6}}, "bottle_types": TYPES,
        "changes": {"bottle": "full"}, **LOADED,
    }  # fmt: skip
    sim = stationed(4.0, **given)
    for ticks in (450, 200, 37, 160):
        sim.advance(ticks)
        assert sim.counts.held > 1
        sim.save(tmp_path / "there")
        loaded = Simulation.load(tmp_path / "there", threads)
        for each in (sim, loaded):
            each.advance(100)
        assert loaded.full_state_hash() == sim.full_state_hash()
        assert loaded.signals().tolist() == sim.signals().tolist()
        assert loaded.counts == sim.counts


def test_a_recording_replays_and_shows_the_types(tmp_path: Path) -> None:
    sim = stationed(4.0, **RINSER, bottle_types=TYPES, changes={"bottle": "full"}, outputs={"bottles": 10.0})
    with Recorder(tmp_path / "bag") as recorder:
        outputs = OutputWriter(sim, [recorder], run_id="run")
        outputs.start()
        for _ in range(1200):
            sim.advance()
            outputs.after_tick()
    report = replay(tmp_path / "bag")
    assert (report.difference, report.exact, report.last_tick) == (None, True, 1200)
    with open_bag(tmp_path / "bag") as bag:
        for frame in bag.read("bottles"):
            assert np.array_equal(frame.data.type, (frame.data.x > 1.05).astype(np.uint16))
        assert (frame.data.type == 1).sum() > 2


def test_a_filled_bottle_has_mass_radius_and_inertia_of_its_new_type() -> None:
    """The ledger books its energy with the new mass: fed energy rises by m v^2 / 2, removed energy with the old one."""
    sim = stationed(0.2, rate=1.0, changes={"bottle": "full"}, bottle_types=TYPES, outputs={"ledger": 1.0})
    sim.advance(450)
    before = None
    while not of(sim, "processed"):
        before = sim.ledger()
        sim.advance()
    after, world = sim.ledger(), sim._state.world
    assert before is not None and after is not None
    (slot,) = np.flatnonzero(world.bottles.id == 0)
    assert world.bottles.type[slot] == 1
    assert world.bottles.radius[slot] == pytest.approx(1.2 * RADIUS)
    assert 1.0 / world.bottles.inverse_mass[slot] == pytest.approx(3.0 * MASS)
    assert world.bottles.weight[slot] == pytest.approx(3.0 * MASS * sim.model.gravity)
    assert after.fed - before.fed == pytest.approx(0.5 * 3.0 * MASS * 0.5**2)
    assert after.removed == before.removed


def test_the_ledger_closes_and_no_bottle_returns_into_another() -> None:
    """Bottles that grow wait for more room; those that shrink for less. The rest of the ledger is rounding."""
    sim = stationed(4.0, rate=3.0, capacity=4, changes={"bottle": "full"}, bottle_types=TYPES, **LOADED)
    overlaps = []
    for _ in range(1500):
        before = set(inside(sim))
        sim.advance()
        bottles = sim.bottles()
        for bottle in before - set(inside(sim)):
            (index,) = np.flatnonzero(bottles.id == bottle)
            apart = np.hypot(bottles.x - bottles.x[index], bottles.y - bottles.y[index])
            apart[index] = np.inf
            radius = sim.model.type_radius[bottles.type]
            overlaps.append(float((radius + radius[index] - apart).max()))
    assert len(overlaps) > 15
    assert max(overlaps) <= 1e-9
    ledger = sim.ledger()
    assert ledger is not None
    assert abs(ledger.residual) < 0.02 * ledger.turnover


def test_types_without_an_entry_stay() -> None:
    types = {**TYPES, "other": kind(RADIUS, 2.0 * MASS)}
    mixed = {"other": source(2.0, bottle="other", position=[0.3, 0.0])}
    sim = stationed(1.0, rate=4.0, changes={"bottle": "full"}, bottle_types=types, machines=mixed)
    sim.advance(1500)
    bottles = sim.bottles()
    assert set(bottles.type[bottles.x > 1.05].tolist()) == {1, 2}
    assert set(bottles.type[bottles.x < 0.8].tolist()) == {0, 2}


def test_the_step_allows_for_a_type_that_only_a_station_makes() -> None:
    """The light type exists only behind the station; its contacts are the stiffest for their mass."""
    light = {"bottle": kind(), "light": kind(RADIUS, 0.01 * MASS)}
    steps = [
        stationed(rate=2.0, bottle_types=light, accuracy="standard", **more).model.steps_per_tick
        for more in ({}, {"changes": {"bottle": "light"}})
    ]
    assert steps[1] > 5 * steps[0]


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (
            {"rate": 3.1, "capacity": 6, "hold": 2.0},
            "machines.capper.rate: 3.1 given, expected at most 3 (1/s), capacity / hold: it has room for 6 bottles "
            "that are each held for 2 s",
        ),
        (
            {"rate": 1.0, "hold": 2.0},
            "machines.capper.rate: 1 given, expected at most 0.5 (1/s), capacity / hold: it has room for a bottle "
            "that is held for 2 s",
        ),
        (
            {"rate": 1.0, "changes": {"bottle": "full"}},
            'machines.capper.changes.bottle: "full" given, expected a name from bottle_types: bottle',
        ),
        (
            {"rate": 1.0, "changes": {"bottle": "bottle"}},
            'machines.capper.changes.bottle: "bottle" given, expected another type',
        ),
        ({"rate": 1.0, "capacity": 0}, "machines.capper.capacity: 0 given, expected a whole number, 1 or greater"),
    ],
)
def test_what_is_refused_and_why(given: dict[str, Any], says: str) -> None:
    with pytest.raises(SceneError) as refused:
        line(rails=RAILS, machines={"capper": station(BEFORE, BEHIND, **given), "packer": sink(4.0)})
    assert says in str(refused.value)


def test_signals_of_an_ordinary_station_stay() -> None:
    """Recordings of stations with one bottle per cycle keep their columns."""
    assert {"machines/capper/held", "machines/capper/time_left"}.isdisjoint(signals(stationed(rate=1.0)))
