# SPDX-License-Identifier: Apache-2.0
"""Sleep is state: same bits for any threads, calls, observers and checkpoints; bottles that are awake keep theirs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from asleep import asleep, awake_run, sleeping_file
from scenes import belt, bottle, segment
from swept import crowd, file_of, run

from conveyor_sim.engine.threads.workers import UNIT
from conveyor_sim.simulation import Simulation

ENDS = 280


def eventful(threads: int = 1) -> Simulation:
    """Return seven files of 20 at one stop: a bottle in the first is removed, and the last is struck from behind."""
    given = file_of(20)
    first = given["bottles"]
    given["rails"] = {"stop": segment((0.0, -0.5), (0.0, 3.0))}
    given["belts"] = {"belt": belt(0.3, (-4.0, -0.5), 5.0, 3.0)}
    given["bottles"] = [bottle(one["position"][0], 0.2 * lane, 0.3) for lane in range(7) for one in first]
    given["bottles"].append(bottle(-0.065 - 20.0 * 0.1305 - 0.7, 1.2, 0.3))
    return run(16, 2, threads=threads, **given)


def go_on(sim: Simulation, calls: tuple[int, ...], look: bool = False) -> Simulation:
    """Advance to ENDS with the events of `eventful`, in calls whose largest numbers of ticks take turns."""
    turn = 0
    while sim.tick < ENDS:
        if sim.tick == 200:
            sim.delete(10)
        stops = [tick for tick in (200, ENDS) if tick > sim.tick]
        sim.advance(min(calls[turn % len(calls)], stops[0] - sim.tick))
        turn += 1
        if look:
            sim.contacts(), sim.bottles()
    return sim


def test_bits_depend_neither_on_threads_nor_on_calls_nor_on_observers() -> None:
    one = eventful()
    one.advance(200)
    most = len(asleep(one))
    assert most > UNIT
    go_on(one, (1000,))
    assert 0 < len(asleep(one)) < most
    for threads, calls, look in ((2, (1000,), False), (3, (1, 30, 7), True)):
        other = go_on(eventful(threads), calls, look)
        assert other.full_state_hash() == one.full_state_hash()
        assert asleep(other) == asleep(one)
        np.testing.assert_array_equal(other.bottles().impulse, one.bottles().impulse)


def test_a_checkpoint_with_sleepers_goes_on_with_the_same_bits(tmp_path: Path) -> None:
    one = go_on(eventful(), (1000,))
    sim = eventful()
    sim.advance(190)
    before = asleep(sim)
    assert before
    sim.save(tmp_path / "there")
    loaded = Simulation.load(tmp_path / "there", threads=2)
    assert asleep(loaded) == before
    assert loaded.integration.asleep_share == sim.integration.asleep_share
    assert go_on(loaded, (50,)).full_state_hash() == one.full_state_hash()


def test_while_all_are_awake_the_bits_are_those_without_sleep() -> None:
    given = {name: value for name, value in crowd(6, 5).items() if name in ("belts", "rails", "bottles")}
    sims = run(**given), awake_run(**given)
    for sim in sims:
        sim.advance(40)
    assert asleep(sims[0]) == []
    assert sims[0].state_hash() == sims[1].state_hash()


def test_sleep_is_part_of_the_hash() -> None:
    sim = sleeping_file(3)
    hashes = sim.state_hash(), sim.full_state_hash()
    sleep = sim._state.world.impulses.sleep  # type: ignore[union-attr]
    assert sleep is not None
    sleep.asleep[0] = 0
    assert sim.state_hash() != hashes[0]
    assert sim.full_state_hash() != hashes[1]


def test_pairs_of_sleepers_come_last_in_their_colour() -> None:
    sim = eventful()
    sim.advance(190)
    world = sim._state.world
    assert world.impulses is not None
    assert world.pairs is not None
    sleep, pairs = world.impulses.sleep, world.pairs.impulse
    assert sleep is not None
    assert pairs is not None
    both = (sleep.asleep[pairs.i] != 0) & (sleep.asleep[pairs.j] != 0)
    assert both[: pairs.start[-1]].any()
    for first, middle, end in zip(pairs.start[:-1], sleep.end, pairs.start[1:], strict=True):
        assert not both[first:middle].any()
        assert both[middle:end].all()


def test_the_share_of_sleepers_is_counted() -> None:
    sim = sleeping_file(5)
    share, ticks = sim.integration.asleep_share, sim.tick
    assert share is not None
    sim.advance(100)
    assert sim.integration.asleep_share == (share * ticks + 100) / (ticks + 100)
    assert awake_run(**file_of(2)).integration.asleep_share is None
