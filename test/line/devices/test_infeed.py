# SPDX-License-Identifier: Apache-2.0
"""Infeeds: tightly packed in-line, rate, jitter from the seed, and free space for each bottle."""

from typing import Any

import numpy as np
import pytest
from scenes import RADIUS, base, belt, contact, segment, simulation

from conveyor_sim.simulation import Simulation

SPEED = 0.5
TICK = 0.01


def infeed(**fields: Any) -> Simulation:
    """Return a line with an infeed at the origin along x, onto a belt of the same speed."""
    belts = fields.pop("belts", {"belt": belt(SPEED)})
    rails = fields.pop("rails", {"stop": segment((4.0, -1.0), (4.0, 1.0))})
    scene_fields = {key: fields.pop(key) for key in ("seed", "outfeeds") if key in fields}
    return simulation(
        tick=TICK,
        accuracy={"per_tick": 20},
        base=base(0.4),
        contacts=[contact(5000.0, damping=("normal", 2.0)), contact(5000.0, "steel", damping=("normal", 2.0))],
        belts=belts,
        rails=rails,
        infeeds={"in": {"bottle": "bottle", "position": [0.0, 0.0], "direction": 0.0, "speed": SPEED, **fields}},
        **scene_fields,
    )


def fed_at(sim: Simulation, ticks: int) -> list[int]:
    """Return the tick at which each bottle entered."""
    found = [sim.tick] * sim.counts.fed
    for _ in range(ticks):
        sim.advance()
        found += [sim.tick] * (sim.counts.fed - len(found))
    return found


def clearances(sim: Simulation) -> np.ndarray:
    state = sim.bottles()
    x, y = state.x, state.y
    i, j = np.triu_indices(x.size, 1)
    return np.hypot(x[i] - x[j], y[i] - y[j]) - 2.0 * RADIUS


def test_a_bottle_that_is_removed_at_once_does_not_hurry_the_in_line() -> None:
    """An outfeed within a pitch of the infeed: still one bottle every pitch / speed."""
    gap, region = 0.01, [[0.05, -1.0], [1.0, -1.0], [1.0, 1.0], [0.05, 1.0]]
    sim = infeed(gap=gap, outfeeds={"out": {"region": region}})
    assert len(fed_at(sim, 200)) == 1 + int(SPEED * 2.0 / (2.0 * RADIUS + gap))


@pytest.mark.parametrize("gap", [0.0, 0.001, 0.05])
@pytest.mark.parametrize("direction", [0.0, 0.6])
def test_packed_bottles_follow_each_other_at_the_gap(gap: float, direction: float) -> None:
    """On a belt of the same speed, the pitch is 2 R + gap up to rounding, at any share of a tick."""
    belts = {"belt": belt(SPEED, (-1.0, -4.0), 9.0, 9.0, angle=direction)}
    sim = infeed(gap=gap, direction=direction, belts=belts)
    sim.advance(300)
    state = sim.bottles()
    pitch = np.hypot(np.diff(state.x), np.diff(state.y))
    np.testing.assert_allclose(pitch, 2.0 * RADIUS + gap, rtol=1e-12)
    assert sim.counts.fed == 1 + int(SPEED * 3.0 / (2.0 * RADIUS + gap) + 1e-9)
    assert sim.counts.blocked_ticks == 0
    assert state.vx[-1] == pytest.approx(SPEED * np.cos(direction))


def test_several_bottles_may_enter_in_one_tick() -> None:
    """At 20 m/s, 1.5 bottles enter per tick."""
    fast = {"belt": belt(20.0, (-1.0, -1.0), 9.0, 2.0, speed_limits=[0, 30])}
    sim = infeed(gap=0.003, speed=20.0, belts=fast, rails={"far": segment((8.0, -1.0), (8.0, 1.0))})
    sim.advance(30)
    assert sim.counts.fed == 1 + int(6.0 / (2.0 * RADIUS + 0.003))
    np.testing.assert_allclose(-np.diff(sim.bottles().x), 2.0 * RADIUS + 0.003, rtol=1e-9)


def test_a_fast_in_line_does_not_put_a_bottle_into_a_rail_ahead() -> None:
    """It moves 50 mm a tick, 45 mm beyond the place of the fifth one, and the stop leaves 35 mm."""
    sim = infeed(
        gap=0.025,
        speed=5.0,
        rails={"stop": segment((RADIUS + 0.035, -1.0), (RADIUS + 0.035, 1.0))},
        outfeeds={"out": {"region": [[0.001, -0.1], [0.2, -0.1], [0.2, 0.1], [0.001, 0.1]]}},
    )
    sim.advance(3)
    assert (sim.counts.fed, sim.counts.removed) == (1, 1)
    sim.advance(1)
    assert sim.bottles().id.tolist() == [1]
    assert sim.bottles().x[0] == pytest.approx(0.035, abs=1e-8)


def test_rails_that_touch_an_in_line_do_not_change_its_gap() -> None:
    """A lane as wide as a bottle: one enters as far ahead as the one before has pulled the in-line on."""
    sides = {"left": segment((-1.0, RADIUS), (4.0, RADIUS)), "right": segment((-1.0, -RADIUS), (4.0, -RADIUS))}
    sim = infeed(gap=0.003, rails=sides)
    sim.advance(200)
    np.testing.assert_allclose(-np.diff(sim.bottles().x), 2.0 * RADIUS + 0.003, rtol=1e-9)
    assert sim.counts.fed > 4


def test_the_count_ends_it() -> None:
    sim = infeed(gap=0.001, count=4)
    sim.advance(400)
    assert (sim.counts.fed, sim.counts.present) == (4, 4)
    assert not sim.signals()[sim.process_image.signal_names.index("infeeds/in/blocked")]


@pytest.mark.parametrize("how", [{"gap": 0.001}, {"rate": 2.0}])
def test_it_starts_at_its_time(how: dict[str, float]) -> None:
    """The first bottle is there at `start`, at the infeed's position and speed."""
    sim = infeed(start=0.3, **how)
    sim.advance(29)
    assert sim.counts.fed == 0
    sim.advance(1)
    state = sim.bottles()
    assert (state.x[0], state.y[0], state.vx[0], state.vy[0]) == (0.0, 0.0, SPEED, 0.0)
    assert infeed(**how).counts.fed == 1


def test_a_full_line_blocks_it_and_never_overlaps() -> None:
    """Against a stop the line fills up to the infeed, which then reports blocked. No bottle overlaps another."""
    sim = infeed(gap=0.001, rails={"stop": segment((0.6, -1.0), (0.6, 1.0))})
    blocked = sim.process_image.signal_names.index("infeeds/in/blocked")
    before = sim.bottles().id.size
    for _ in range(300):
        sim.advance()
        if sim.bottles().id.size > before:
            # The new one may just touch the one before it.
            newest = sim.bottles().x[-1]
            others = sim.bottles().x[:-1]
            assert np.min(others - newest, initial=1.0) >= 2.0 * RADIUS - 1e-8
            before = sim.bottles().id.size
    assert sim.signals()[blocked] == 1.0
    fed, ticks = sim.counts.fed, sim.counts.blocked_ticks
    assert fed == 5
    sim.advance(50)
    assert sim.counts.fed == fed
    assert sim.counts.blocked_ticks == ticks + 50


@pytest.mark.parametrize("how", [{"gap": 0.001}, {"rate": 2.5}])
def test_a_blocked_infeed_recovers(how: dict[str, float]) -> None:
    """The belt stops, the infeed blocks; the belt runs again, bottles enter again at the same distance."""
    sim = infeed(**how)
    blocked = sim.process_image.signal_names.index("infeeds/in/blocked")
    sim.command(["belts/belt/cmd_speed"], [0.0])
    sim.advance(200)
    assert sim.signals()[blocked] == 1.0
    assert np.min(clearances(sim), initial=1.0) > -1e-3
    sim.command(["belts/belt/cmd_speed"], [SPEED])
    fed = sim.counts.fed
    sim.advance(200)
    assert sim.signals()[blocked] == 0.0
    assert sim.counts.fed >= fed + 3
    pitch = 2.0 * RADIUS + how["gap"] if "gap" in how else SPEED / how["rate"]
    state = sim.bottles()
    assert state.x[-2] - state.x[-1] == pytest.approx(pitch, abs=1e-6 if "gap" in how else SPEED * TICK)


def test_a_rate_is_kept_in_the_mean() -> None:
    """The time between bottles, 1/0.3 s, is no whole number of ticks.

    Each bottle enters at the first tick from its time on.
    """
    rate = 3.3
    entered = fed_at(infeed(rate=rate), 600)
    expected = [int(np.ceil(n / rate / TICK - 1e-9)) for n in range(len(entered))]
    assert entered == expected
    assert len(entered) == 1 + int(6.0 * rate)


def test_bottles_that_had_to_wait_shift_those_behind_them() -> None:
    """A timed line does not catch up. After a wait, the next bottle enters one period after the delayed one."""
    rate = 2.0
    sim = infeed(rate=rate)
    sim.command(["belts/belt/cmd_speed"], [0.0])
    waited = fed_at(sim, 300)
    sim.command(["belts/belt/cmd_speed"], [SPEED])
    after = fed_at(sim, 300)[len(waited) :]
    assert len(after) >= 3
    np.testing.assert_allclose(np.diff(after) * TICK, 1.0 / rate, atol=TICK)


def test_timing_jitter_of_a_rate() -> None:
    """Bottles are early or late by up to the jitter, around times 1/rate apart, with varying jitter."""
    rate, jitter = 2.5, 0.05
    entered = np.array(fed_at(infeed(rate=rate, timing_jitter=jitter, start=0.2), 1000)) * TICK
    late = entered - 0.2 - np.arange(entered.size) / rate
    assert np.all(late >= -jitter - 1e-9)
    assert np.all(late <= jitter + TICK)
    assert late.min() < -0.5 * jitter
    assert late.max() > 0.5 * jitter
    assert entered.size >= 1 + int((10.0 - 0.2 - jitter) * rate)


def test_timing_jitter_of_a_packed_line() -> None:
    """Packed bottles can only be late: gaps grow by up to speed times the jitter, evenly."""
    jitter, gap = 0.08, 0.002
    sim = infeed(gap=gap, timing_jitter=jitter)
    sim.advance(700)
    extra = -np.diff(sim.bottles().x) - 2.0 * RADIUS - gap
    assert np.all(extra >= -1e-12)
    assert np.all(extra <= SPEED * jitter + 1e-12)
    assert extra.max() - extra.min() > 0.5 * SPEED * jitter


def test_lateral_jitter_moves_bottles_sideways_within_its_bounds() -> None:
    """Evenly to both sides of the direction; along it nothing changes."""
    jitter = 0.05
    sim = infeed(gap=0.001, lateral_jitter=jitter)
    sim.advance(700)
    y = sim.bottles().y
    assert np.all(np.abs(y) <= jitter)
    assert y.min() < -0.5 * jitter
    assert y.max() > 0.5 * jitter
    np.testing.assert_allclose(-np.diff(sim.bottles().x), 2.0 * RADIUS + 0.001, rtol=1e-9)


def test_jitter_is_drawn_from_the_seed() -> None:
    """Equal seeds give equal bottles, other seeds other ones. Without jitter the seed has no effect."""

    def places(seed: int, **jitter: float) -> list[float]:
        sim = infeed(seed=seed, gap=0.001, **jitter)
        sim.advance(200)
        return [*sim.bottles().x.tolist(), *sim.bottles().y.tolist()]

    jitter = {"timing_jitter": 0.05, "lateral_jitter": 0.02}
    assert places(1, **jitter) == places(1, **jitter)
    assert places(1, **jitter) != places(2, **jitter)
    assert places(1) == places(2)


def test_each_infeed_has_a_stream_of_its_own() -> None:
    """The draws of one infeed do not depend on the number of draws of another."""

    def second(first_count: int) -> list[float]:
        common = {"bottle": "bottle", "direction": 0.0, "speed": SPEED, "gap": 0.001, "lateral_jitter": 0.05}
        sim = simulation(
            seed=5,
            tick=TICK,
            accuracy={"per_tick": 20},
            base=base(0.4),
            contacts=[contact(5000.0, damping=("normal", 2.0)), contact(5000.0, "steel", damping=("normal", 2.0))],
            belts={"belt": belt(SPEED)},
            rails={"stop": segment((4.0, -1.0), (4.0, 1.0))},
            infeeds={
                "first": {**common, "position": [0.0, 2.0], "count": first_count},
                "second": {**common, "position": [0.0, 0.0]},
            },
        )
        sim.advance(200)
        y = sim.bottles().y
        return y[y < 1.0].tolist()

    assert second(2) == second(9)
