# SPDX-License-Identifier: Apache-2.0
"""The measure of resting load: closed forms, impacts left out, scenes that never settle."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from facts import missing
from scenes import arc, base, belt, bottle, contact, scene, segment

from conveyor_sim.accuracy.measure.resting import Loads, RestingLoad, difference, loads_from, mean_loads, resting_error
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.accuracy.trajectory import variant
from conveyor_sim.scene import Scene

MU, MASS, G = 0.4, 0.2, 9.81
RADIUS = 0.065
QUEUE = 5
STOP = segment((0.0, -0.3), (0.0, 0.3))
ROW = [bottle(-RADIUS - 0.001 - 0.131 * row, 0.0) for row in range(QUEUE)]
EULER, VERLET = "semi_implicit_euler", "velocity_verlet"


def silent(_done: float, _whole: float) -> None:
    pass


def laws(**more: Any) -> list[dict[str, Any]]:
    """Contacts that lose most of an impact, so that what presses comes to rest soon."""
    return [contact(2e4, other, damping=("normal", 20.0), friction=0.0, **more) for other in ("glass", "steel")]


def queue(**fields: Any) -> Scene:
    """Bottles on a straight belt, one behind the other, the first of them just before a stop."""
    fields = {
        "duration": 4.0,
        "contacts": laws(),
        "belts": {"belt": belt(0.3)},
        "rails": {"stop": STOP},
        "bottles": ROW,
        **fields,
    }
    return scene(base=base(MU), **fields)


def rim(speed: float = 0.3) -> Scene:
    """Three bottles that a turn-table carries along its rim, pressed to it by nothing but their own inertia."""
    at = 0.5 - RADIUS
    angles = np.radians([0.0, 120.0, 240.0])
    turn = speed / 0.25
    return scene(
        duration=4.0,
        contacts=laws(),
        base=base(MU),
        belts={
            "disc": {"kind": "curved", "centre": [0, 0], "inner_radius": 0, "width": 0.5, "start_angle": 0.0,
                     "span": "360 deg", "material": "chain", "speed": speed}
        },
        rails={"rim": arc((0.0, 0.0), 0.5, 0.0, 2.0 * np.pi)},
        bottles=[
            bottle(at * np.cos(a), at * np.sin(a), -turn * at * np.sin(a), turn * at * np.cos(a)) for a in angles
        ],
    )  # fmt: skip


@pytest.fixture(scope="module")
def settled_queue() -> RestingLoad:
    resting = RestingLoad(queue())
    resting.settle(silent)
    resting.make_reference(silent)
    return resting


@pytest.fixture(scope="module")
def settled_rim() -> RestingLoad:
    resting = RestingLoad(rim())
    resting.settle(silent)
    resting.make_reference(silent)
    return resting


def test_a_queue_presses_with_what_stands_behind(settled_queue: RestingLoad) -> None:
    """The stop carries n mu m g, the contact behind the k-th bottle (n - k) mu m g."""
    loads = settled_queue.reference
    assert loads is not None
    assert loads.contact.tolist() == [*([0, k, k + 1] for k in range(QUEUE - 1)), [1, 0, 0]]
    expected = MU * MASS * G * np.array([*(QUEUE - 1 - k for k in range(QUEUE - 1)), QUEUE])
    assert loads.force == pytest.approx(expected, rel=1e-6)
    assert settled_queue.doubt is not None and settled_queue.doubt < 1e-6


def test_bottles_at_a_rim_press_by_their_inertia(settled_rim: RestingLoad) -> None:
    """m Omega^2 r: a bottle that goes round with the disc at one distance does not slip on it."""
    loads = settled_rim.reference
    assert loads is not None
    at = 0.5 - RADIUS
    assert loads.contact.tolist() == [[1, 0, 0], [1, 1, 0], [1, 2, 0]]
    assert loads.force == pytest.approx(np.full(3, MASS * (0.3 / 0.25) ** 2 * at), rel=2e-3)
    assert settled_rim.doubt is not None and settled_rim.doubt < 1e-5


def test_euler_is_first_order_on_a_turning_belt(settled_rim: RestingLoad) -> None:
    """Off by mu g dt / v_lim: it brakes by the velocity of half a step before, which points half a step outwards."""
    found = {}
    for steps in (48, 96):
        found[steps] = settled_rim.error_of(variant(settled_rim.scene, Setting(EULER, steps)))
        assert found[steps] == pytest.approx(MU * G * 0.01 / steps / 0.01, rel=0.05)
    verlet = settled_rim.error_of(variant(settled_rim.scene, Setting(VERLET, 48)))
    assert verlet is not None and verlet < 1e-4


def test_nothing_is_first_order_on_a_straight_belt(settled_queue: RestingLoad) -> None:
    """Friction that slides is the same at every step."""
    error = settled_queue.error_of(variant(settled_queue.scene, Setting(EULER, 100)))
    assert error is not None and error < 1e-6


def test_impacts_do_not_leak_in(settled_queue: RestingLoad) -> None:
    """A bottle that a rail throws to and fro beside the queue changes no load of the queue, and has none itself."""
    assert settled_queue.reference is not None
    thrown = bottle(3.0, 0.0, 3.0, 0.0)
    box = {"left": segment((2.9, -1.0), (2.9, 1.0)), "right": segment((3.1, -1.0), (3.1, 1.0))}
    busy = queue(
        rails={"stop": STOP, **box},
        contacts=[laws()[0], contact(2e4, "steel", damping=("normal", 0.01), friction=0.0)],
        bottles=[*ROW, thrown],
        belts={"belt": belt(0.3, length=6.0)},
        floor="none",
    )
    run = variant(busy, settled_queue.reference_setting or Setting(VERLET, 100))
    run.advance(round(3.0 / busy.tick))
    peak = run.peak_force
    loads = mean_loads(run)
    assert peak is not None and peak > 30.0  # the bottle was thrown
    assert loads.contact.tolist() == settled_queue.reference.contact.tolist()
    assert loads.force == pytest.approx(settled_queue.reference.force, rel=1e-2)


def test_a_scene_that_never_settles_says_so() -> None:
    """One queue whose belt is not yet there: nothing rests; one that grows: its forces change."""
    empty = RestingLoad(queue(bottles=[bottle(-4.0, 0.0)], duration=2.0))
    empty.settle(silent)
    assert not empty.settled
    assert missing(empty.reason, ["no contact", "1 s", "4 s"]) == []
    feed = {"bottle": "bottle", "position": [-2.0, 0.0], "direction": 0.0, "speed": 1.0, "rate": 0.6}
    growing = RestingLoad(queue(bottles=[], infeeds={"more": feed}, belts={"belt": belt(1.0)}))
    growing.settle(silent)
    assert not growing.settled
    assert missing(growing.reason, ["forces", "changing", "8 s"]) == []
    with pytest.raises(ValueError, match="no settled state"):
        growing.make_reference(silent)


def test_only_contacts_of_both_runs_count() -> None:
    one = Loads(np.array([[0, 1, 2], [1, 1, 0]]), np.array([3.0, 5.0]))
    other = Loads(np.array([[0, 0, 2], [1, 1, 0]]), np.array([7.0, 4.0]))
    assert difference(one, other) == 0.25
    assert difference(one, Loads(np.zeros((0, 3), np.int64), np.zeros(0))) is None


def test_from_a_state_that_stays_as_it_is(settled_queue: RestingLoad) -> None:
    assert settled_queue.state is not None and settled_queue.reference is not None
    before = settled_queue.state.state_hash()
    run = variant(settled_queue.scene, Setting(VERLET, 200))
    first = loads_from(run, settled_queue.state)
    again = loads_from(run, settled_queue.state)
    assert settled_queue.state.state_hash() == before
    assert np.array_equal(first.force, again.force)
    assert resting_error(run, settled_queue.state, first) == 0.0
