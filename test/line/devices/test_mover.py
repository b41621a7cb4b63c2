# SPDX-License-Identifier: Apache-2.0
"""Gates, pushers and diverters as controllers see them: commands, end switches, jams, motion profiles."""

import math
from typing import Any

import numpy as np
import pytest
from physics.test_moving_rails import plant
from scenes import RADIUS, bottle

from conveyor_sim.line.devices.mover import later, profile_to, resting
from conveyor_sim.simulation import Simulation

STROKE, TOP, ACCELERATION = 0.3, 0.5, 2.0


def alone(*bottles: dict[str, Any], **more: Any) -> Simulation:
    """Return a line with a pusher, and a gate far away that is open at the start.

    A bottle out of the way makes the tests share kernels.
    """
    steel = {"material": "steel", "max_speed": TOP, "acceleration": ACCELERATION}
    pusher = {"from": [0.0, -0.2], "to": [0.0, 0.2], "direction": 0.0, "stroke": STROKE, **steel}
    gate = {"kind": "swing", "from": [9.0, 5.0], "to": [9.5, 5.0], "angle": "-90 deg", "open": True, **steel}
    return plant(*bottles, bottle(20.0, 21.0), pushers={"p": pusher}, gates={"g": gate}, diverters={}, **more)


def seen(sim: Simulation, name: str) -> tuple[float, ...]:
    """Return the position and both end switches."""
    signals = dict(zip(sim.process_image.signal_names, sim.signals().tolist(), strict=True))
    position, home, away, *_ = (value for signal, value in signals.items() if signal.startswith(f"{name}/"))
    return position, home, away


def test_the_process_image_has_them() -> None:
    image = alone().process_image
    assert tuple(name for name in image.signal_names if not name.startswith(("belts/", "alarm"))) == (
        "gates/g/position", "gates/g/is_closed", "gates/g/is_open", "gates/g/blocked",
        "pushers/p/position", "pushers/p/retracted", "pushers/p/extended", "pushers/p/blocked",
        "gates/g/mode", "pushers/p/mode",
    )  # fmt: skip
    assert image.command_names[1:] == ("gates/g/open", "pushers/p/push")
    assert image.fault_names == ("gates/g/jammed", "pushers/p/jammed")
    assert {tag.kind for tag in (*image.commands[1:], *image.faults)} == {"bool"}


def test_a_stroke_takes_its_time_and_there_are_switches_at_its_ends() -> None:
    """0.85 s out: 0.3 m at 0.5 m/s, and 0.25 s to speed up and brake; as long back."""
    sim = alone()
    assert (seen(sim, "gates/g"), seen(sim, "pushers/p")) == ((1.0, 0.0, 1.0), (0.0, 1.0, 0.0))
    sim.command(["pushers/p/push", "gates/g/open"], [1, 0])
    sim.advance(25)
    assert seen(sim, "pushers/p") == pytest.approx((0.5 * TOP * 0.25 / STROKE, 0.0, 0.0))
    sim.advance(60)
    assert seen(sim, "pushers/p") == pytest.approx((1.0, 0.0, 1.0))
    sim.command(["pushers/p/push"], [0])
    sim.advance(20)
    # A command that is given again changes nothing.
    sim.command(["pushers/p/push"], [0])
    sim.advance(64)
    assert seen(sim, "pushers/p")[0] < 1e-3
    sim.advance(1)
    assert seen(sim, "pushers/p") == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)
    sim.advance(300)
    assert seen(sim, "gates/g") == (0.0, 1.0, 0.0)


def test_a_jammed_rail_stands_where_it_was_and_goes_on_when_it_is_free() -> None:
    """It stops at once. A bottle that moves up against it stays on its side."""
    sim = alone(bottle(0.3, 0.0, -0.2, 0.0))
    sim.command(["pushers/p/push"], [1])
    sim.advance(30)
    place = seen(sim, "pushers/p")[0]
    sim.inject("pushers/p/jammed", 1)
    sim.advance(30)
    assert seen(sim, "pushers/p") == (place, 0.0, 0.0)
    sim.command(["pushers/p/push"], [0])
    sim.advance(20)
    assert seen(sim, "pushers/p") == (place, 0.0, 0.0)
    assert sim.bottles().x[0] > place * STROKE + 0.9 * RADIUS
    sim.inject("pushers/p/jammed", 0)
    way = place * STROKE
    sim.advance(math.ceil(100.0 * 2.0 * math.sqrt(way / ACCELERATION)) + 1)
    assert seen(sim, "pushers/p") == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)


def test_no_bottle_enters_where_a_rail_stands() -> None:
    """It waits until the pusher is home again."""
    feed = {"bottle": "bottle", "position": [0.25, 0.0], "direction": 0.0, "speed": 0.2, "rate": 1.0, "start": 1.0}
    sim = alone(infeeds={"in": feed})
    sim.command(["pushers/p/push"], [1])
    sim.advance(110)
    assert (sim.counts.fed, sim.counts.blocked_ticks) == (0, 11)
    sim.command(["pushers/p/push"], [0])
    sim.advance(85)
    assert sim.counts.fed == 1


TOP, ACCELERATION = 0.5, 2.0


def at(course: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return position and speed at times (n,)."""
    phase = np.maximum(np.searchsorted(course[:, 0], times, side="right") - 1, 0)
    begin, position, speed, acceleration = course[phase].T
    since = times - begin
    return position + speed * since + 0.5 * acceleration * since**2, speed + acceleration * since


@pytest.mark.parametrize(
    ("position", "speed", "target", "duration"),
    [
        (0.0, 0.0, 1.0, 1.0 / TOP + TOP / ACCELERATION),
        (1.0, 0.0, 0.0, 1.0 / TOP + TOP / ACCELERATION),
        # Too short for full speed: a triangle.
        (0.2, 0.0, 0.3, 2.0 * math.sqrt(0.1 / ACCELERATION)),
        # It turns round: to a stop, from where it is as far again as it took.
        (0.5, TOP, 0.0, TOP / ACCELERATION + (0.5 + TOP**2 / (2.0 * ACCELERATION)) / TOP + TOP / ACCELERATION),
        # Too fast to stop in time: past it and back.
        (0.0, 0.4, 0.01, 0.4 / ACCELERATION + 2.0 * math.sqrt((0.04 - 0.01) / ACCELERATION)),
        # Just in time.
        (0.0, 0.4, 0.04, 0.4 / ACCELERATION),
        (0.3, 0.0, 0.3, 0.0),
    ],
)
def test_it_takes_the_least_time_there_is(position: float, speed: float, target: float, duration: float) -> None:
    course = profile_to(position, speed, target, TOP, ACCELERATION)
    assert course[-1] == pytest.approx([duration, target, 0.0, 0.0], abs=1e-8)
    times = np.linspace(0.0, duration + 1.0, 20001)
    where, fast = at(course, times)
    assert (where[0], fast[0]) == pytest.approx((position, speed), abs=1e-12)
    assert np.abs(fast).max() <= max(TOP, abs(speed)) + 1e-12
    assert np.abs(np.diff(fast)).max() <= ACCELERATION * (times[1] - times[0]) * (1.0 + 1e-9)
    # Position is what speed adds up to: no jumps.
    np.testing.assert_allclose(np.diff(where), 0.5 * (fast[1:] + fast[:-1]) * np.diff(times), atol=1e-7)


def test_a_course_seen_later_is_the_same() -> None:
    course = profile_to(0.1, -0.2, 0.7, TOP, ACCELERATION)
    times = np.linspace(0.4, 3.0, 50)
    np.testing.assert_allclose(at(later(course, 0.4), times - 0.4), at(course, times), atol=1e-12)
    assert at(resting(0.3), times)[0] == pytest.approx(np.full(50, 0.3))
