# SPDX-License-Identifier: Apache-2.0
"""Observables of runs that can be worked out by hand: queues, flows, an impact, a fill."""

import math
from typing import Any

import numpy as np
import pytest
from scenes import MASS, RADIUS, base, belt, bottle, contact, scene, segment

from conveyor_sim.accuracy.measure.observables import OBSERVABLES, measuring, observe
from conveyor_sim.accuracy.setting import Setting, with_setting
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

MU, G = 0.4, 9.81
STIFFNESS = 50e3
PULL = MU * MASS * G
"""N, of a belt on one bottle that it slips below."""


def line(damping: float = 300.0, **fields: Any) -> Scene:
    """Glass on a floor and belts of chain, rails of steel; nothing is there yet but a rail out of the way."""
    parts: dict[str, Any] = {
        "tick": 0.01,
        "gravity": G,
        "base": base(MU),
        "contacts": [contact(STIFFNESS, other, damping=("normal", damping)) for other in ("glass", "steel")],
        "belts": {"belt": belt(0.5)},
        "rails": {"rail": segment((-3.0, 3.0), (-2.0, 3.0))},
    }
    return scene(**{**parts, **fields})


def run(it: Scene, per_tick: int = 200) -> tuple[dict[str, float], Simulation]:
    """Observables of a scene, and the simulation at its end."""
    simulation = Simulation(with_setting(it, Setting("semi_implicit_euler", per_tick), **measuring(it)), threads=1)
    return observe(simulation), simulation


def queue(count: int) -> Scene:
    """Bottles that touch each other and a stop, on a belt that begins to pull."""
    return line(
        damping=800.0,
        duration=1.0,
        rails={"stop": segment((0.0, -1.0), (0.0, 1.0))},
        bottles=[bottle(-RADIUS - 2.0 * RADIUS * i, 0.0) for i in range(count)],
    )


def test_forces_in_a_queue() -> None:
    """The contact before bottle i of n carries (n - i) mu m g, that behind it (n - i - 1): in the mean n mu m g.

    Momentum is nought at the start and at the end, so the mean is exact; and no overlap is past its last value, as
    even the slowest mode of the queue is overdamped.
    """
    count = 5
    values, simulation = run(queue(count))
    assert values["mean queue force"] == pytest.approx(count * PULL, rel=1e-9)
    # One in five forces is the first bottle's, so that the 95th percentile is.
    assert values["queue force, 95th percentile"] == pytest.approx((2 * count - 1) * PULL, rel=1e-6)
    contacts = simulation.contacts()
    assert values["largest overlap"] == pytest.approx(100.0 * contacts.overlap.max() / (2.0 * RADIUS), rel=1e-6)
    assert values["largest overlap"] == pytest.approx(100.0 * count * PULL / STIFFNESS / (2.0 * RADIUS), rel=1e-5)
    assert values["spacing"] == pytest.approx(
        2.0 * RADIUS - PULL / STIFFNESS * np.mean([4, 4, 3, 2, 1]), abs=1e-6 * PULL / STIFFNESS
    )
    assert not {"throughput", "time to fill"} & values.keys()


def test_overlap_in_a_pair_is_told_by_the_smaller_bottle() -> None:
    """A small bottle between a large one and the stop: it is in both contacts."""
    small = {"radius": 0.02, "mass": MASS, "material": "glass"}
    values, simulation = run(
        line(
            duration=0.5,
            bottle_types={"bottle": {"radius": RADIUS, "mass": MASS, "material": "glass"}, "small": small},
            contacts=[contact(1e3, damping=("normal", 40.0)), contact(STIFFNESS, "steel", damping=("normal", 300.0))],
            rails={"stop": segment((0.0, -1.0), (0.0, 1.0))},
            bottles=[{**bottle(-0.02, 0.0), "type": "small"}, bottle(-0.04 - RADIUS, 0.0)],
        )
    )
    overlap = simulation.contacts().overlap[simulation.contacts().kind == 0]
    assert overlap == pytest.approx(PULL / 1e3, rel=1e-3)
    assert values["largest overlap"] == pytest.approx(100.0 * overlap[0] / 0.04, rel=1e-3)


def test_peak_of_an_impact() -> None:
    """Head on without damping, v sqrt(k m_r) on both; they meet 5 ms into an interval of 20 and part 4.4 ms later."""
    speed = 0.5
    values, _ = run(
        line(
            damping=1e-9,
            duration=0.1,
            belts={"far": belt(0.0, (50.0, 0.0), 1.0, 1.0)},
            floor={"friction": 0.0},
            bottles=[bottle(0.0, 0.0, speed), bottle(2.0 * RADIUS + speed * 0.045, 0.0)],
        ),
        per_tick=500,
    )
    steps_per_contact = math.pi * math.sqrt(0.5 * MASS / STIFFNESS) / (0.01 / 500)
    # A peak is off by (pi / n)^2 / 8 at most with n steps a contact; the speeds after it, by less.
    error = (math.pi / steps_per_contact) ** 2 / 8.0
    assert values["peak force, 99th percentile"] == pytest.approx(speed * math.sqrt(STIFFNESS * 0.5 * MASS), rel=error)
    assert values["mean queue force"] == pytest.approx(speed * MASS / 0.02, rel=error)


def test_throughput_of_an_outfeed_is_that_of_the_infeed() -> None:
    """Five a second at the speed of the belt, which never touch; the first leave before the second half begins."""
    values, simulation = run(
        line(
            duration=2.0,
            infeeds={"in": {"bottle": "bottle", "position": [0.0, 0.0], "direction": 0.0, "speed": 0.8, "rate": 5.0}},
            outfeeds={"out": {"region": [[0.5, -1.0], [1.0, -1.0], [1.0, 1.0], [0.5, 1.0]]}},
            belts={"belt": belt(0.8)},
        )
    )
    assert simulation.counts.removed > 5
    assert values["throughput"] == pytest.approx(300.0, rel=1e-12)
    assert values["mean queue force"] == values["peak force, 99th percentile"] == values["largest overlap"] == 0.0
    assert values["time to fill"] == 2.0


def test_throughput_of_a_loop_is_its_rounds() -> None:
    """Four belts around a square: rounds are counted by the bottle's angle about the middle, from belt 4 to belt 1."""
    speed, width = 1.0, 0.3
    belts = {
        "east": belt(speed, (0.0, 0.0), 0.7, width),
        "north": belt(speed, (1.0, 0.0), 0.7, width, angle="90 deg"),
        "west": belt(speed, (1.0, 1.0), 0.7, width, angle="180 deg"),
        "south": belt(speed, (0.0, 1.0), 0.7, width, angle="270 deg"),
    }
    it = line(duration=8.0, belts=belts, bottles=[bottle(0.35, 0.15, speed), bottle(-3.0, -3.0)])
    values, simulation = run(it, per_tick=50)
    other = Simulation(simulation.scene, threads=1)
    places = []
    for _ in range(it.duration_ticks):
        other.advance()
        places.append((other.bottles().x[0], other.bottles().y[0]))
    x, y = np.transpose(places)
    into_east = np.flatnonzero((x[1:] < width) & (y[1:] < width) & (y[:-1] >= width)) + 1
    returns = int(np.count_nonzero(into_east >= len(x) // 2))
    assert returns >= 1
    assert len(into_east) > returns
    assert values["throughput"] == pytest.approx(returns * 60.0 / 4.0, rel=1e-12)


def test_a_line_is_filled_when_the_last_counted_bottle_is_in() -> None:
    """Bottles 0.132 m apart at 0.5 m/s: the third is due 0.528 s after the first, so at the tick at 0.53 s."""
    feed = {"bottle": "bottle", "position": [0.0, 0.0], "direction": 0.0, "speed": 0.5, "gap": 0.002, "count": 3}
    values, _ = run(line(duration=0.8, infeeds={"in": feed}))
    assert values["time to fill"] == pytest.approx(0.53, abs=1e-9)


def test_a_line_is_filled_when_an_infeed_is_blocked() -> None:
    """On a floor that stops the first bottle, the next is late after twice the 0.264 s that it should have taken."""
    feed = {"bottle": "bottle", "position": [0.0, 0.0], "direction": 0.0, "speed": 0.5, "gap": 0.002, "count": 3}
    values, _ = run(line(duration=0.8, belts={"far": belt(0.5, (50.0, 0.0), 1.0, 1.0)}, infeeds={"in": feed}))
    assert values["time to fill"] == pytest.approx(0.53, abs=1e-9)


def test_nothing_is_looked_at_but_what_a_scene_has() -> None:
    """One bottle alone: no contact, no neighbour, no way in or out."""
    alone = scene(duration=0.1, tick=0.01, accuracy={"per_tick": 50}, base=base(MU), belts={"belt": belt(0.5)},
                  bottles=[bottle(0.0, 0.0)])  # fmt: skip
    values, _ = run(alone)
    assert values == {}


@pytest.mark.parametrize(("tick", "rate"), [(0.01, 50.0), (0.004, 50.0), (0.015, 1.0 / 0.015), (0.1, 10.0)])
def test_measuring_asks_for_peaks_at_a_rate_that_the_tick_allows(tick: float, rate: float) -> None:
    """And for no other effect; peaks that are forced off are on again."""
    it = line(tick=tick, accuracy={"per_tick": 50}, effects={"peaks": "off"})
    setting = Setting("semi_implicit_euler", 50)
    plain, watched = (Simulation(with_setting(it, setting, **fields)).model for fields in ({}, measuring(it)))
    on = {choice.name for choice in watched.effects if choice.on}
    assert on == {choice.name for choice in plain.effects if choice.on} | {"peaks"}
    assert with_setting(it, setting, **measuring(it)).outputs.bottles == pytest.approx(rate)


def test_a_scene_without_peaks_is_refused() -> None:
    with pytest.raises(ValueError, match="measuring"):
        observe(Simulation(line()))


def test_every_observable_says_what_it_is() -> None:
    names = [observable.name for observable in OBSERVABLES]
    assert len(set(names)) == len(names)
    assert all(observable.unit and observable.description.endswith(".") for observable in OBSERVABLES)
