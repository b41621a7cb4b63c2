# SPDX-License-Identifier: Apache-2.0
"""Photo-eyes: edges at the right time within a tick, delays in whole ticks, and faults."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from line.devices.eye_line import SPEED, across, eye_line, falls, read, rises
from scenes import RADIUS

from conveyor_sim.line.devices.photo_eye import Timer
from conveyor_sim.simulation import Simulation


def trace(sim: Simulation, ticks: int, *eyes: str) -> dict[str, list[bool]]:
    """Return `blocked` of each eye at every tick from 0 on."""
    found: dict[str, list[bool]] = {eye: [] for eye in eyes}
    for tick in range(ticks + 1):
        for eye in eyes:
            found[eye].append(read(sim)[f"photo_eyes/{eye}/blocked"] == 1.0)
        if tick < ticks:
            sim.advance()
    return found


def changes(levels: list[bool]) -> list[int]:
    """Return the ticks at which a signal changes."""
    return [tick for tick in range(1, len(levels)) if levels[tick] != levels[tick - 1]]


@pytest.mark.parametrize("speed", [0.0731, 0.5, 1.37])
def test_two_eyes_measure_the_speed_of_a_bottle_and_one_its_diameter(speed: float) -> None:
    """The tick is 10 ms, in which it moves by up to a fifth of its radius. The error is below 0.1 %."""
    eyes = {"one": across(0.1003), "other": across(0.3377)}
    sim = eye_line(speed, photo_eyes=eyes)
    sim.advance(round(0.45 / speed / 0.01))
    one, other = read(sim, "photo_eyes/one/"), read(sim, "photo_eyes/other/")
    assert (one["edges"], other["edges"]) == (2.0, 2.0)
    for edge in ("rose", "fell"):
        assert (0.3377 - 0.1003) / (other[edge] - one[edge]) == pytest.approx(speed, rel=1e-3)
        assert abs(one[edge] / 0.01 - round(one[edge] / 0.01)) > 1e-3  # it says little if it falls on a tick
    assert (one["fell"] - one["rose"]) * speed == pytest.approx(2.0 * RADIUS, rel=1e-3)
    assert one["rose"] == pytest.approx(rises(0.1003, speed), rel=1e-3)


def test_a_bottle_off_the_middle_of_the_beam_blocks_it_for_less_long() -> None:
    """A beam that ends 0.04 m beside the axis meets a chord of the circle. One 0.07 m beside it is never blocked."""
    eyes = {"chord": {"from": [0.3, 0.2], "to": [0.3, 0.04]}, "past": {"from": [0.3, 0.2], "to": [0.3, 0.07]}}
    sim = eye_line(photo_eyes=eyes)
    sim.advance(120)
    chord = read(sim, "photo_eyes/chord/")
    assert (chord["fell"] - chord["rose"]) * SPEED == pytest.approx(2.0 * np.sqrt(RADIUS**2 - 0.04**2), rel=1e-3)
    assert read(sim, "photo_eyes/past/")["edges"] == 0.0


def test_a_bottle_that_passes_within_one_tick_leaves_two_edges() -> None:
    """The tick is 0.25 s at 1 m/s, the beam is blocked for 0.13 m: free at every tick, and yet detected."""
    eyes = {"eye": across(0.375)}
    sim = eye_line(1.0, tick=0.25, accuracy={"per_tick": 500}, photo_eyes=eyes)
    assert not any(trace(sim, 4, "eye")["eye"])
    eye = read(sim, "photo_eyes/eye/")
    assert eye["edges"] == 2.0
    assert (eye["rose"], eye["fell"]) == pytest.approx((rises(0.375, 1.0), falls(0.375, 1.0)), rel=1e-4)


def test_bottles_nose_to_tail_are_one_and_a_gap_is_a_gap() -> None:
    """Two bottles touch, a third follows 5 mm behind. A beam that is blocked at the start has no edge for that."""
    row = (0.0, -2.0 * RADIUS, -4.0 * RADIUS - 5e-3)
    sim = eye_line(xs=row, photo_eyes={"eye": across(0.3), "there": across(0.01)})
    assert read(sim, "photo_eyes/there/") == {"blocked": 1.0, "rose": 0.0, "fell": 0.0, "edges": 0.0}
    sim.advance(round(100.0 * (0.3 + 4.0 * RADIUS) / SPEED))
    eye = read(sim, "photo_eyes/eye/")
    assert (eye["edges"], eye["blocked"]) == (3.0, 1.0)
    assert (eye["rose"] - eye["fell"]) * SPEED == pytest.approx(5e-3, rel=1e-3)
    assert eye["fell"] == pytest.approx(falls(0.3 + 2.0 * RADIUS), rel=1e-6)


def test_delays_and_debounce_are_exact_in_ticks() -> None:
    """The beam is blocked for 0.26 s from 0.4712 s on. Changes occur at the first tick that is late enough."""
    x = 0.3006
    delays: dict[str, dict[str, Any]] = {
        "plain": {},
        "on": {"on_delay": 0.05},
        "off": {"off_delay": 0.031},
        "both": {"on_delay": 0.11, "off_delay": 0.02},
        "never": {"on_delay": 0.27},
        "steady": {"debounce": 0.1},
        "deaf": {"debounce": 0.261},
        "all": {"debounce": 0.05, "on_delay": 0.1, "off_delay": 0.2},
    }
    sim = eye_line(photo_eyes={name: across(x, **delay) for name, delay in delays.items()})
    levels = trace(sim, 120, *delays)
    rose, fell = rises(x), falls(x)

    def first_tick(time: float) -> int:
        return int(np.ceil(time / 0.01 - 1e-6))

    for name, delay in delays.items():
        on = delay.get("debounce", 0.0) + delay.get("on_delay", 0.0)
        off = delay.get("debounce", 0.0) + delay.get("off_delay", 0.0)
        expected = [first_tick(rose + on), first_tick(fell + off)] if name not in ("never", "deaf") else []
        assert changes(levels[name]) == expected, name
    # The times are those of the beam, whatever the delays; what is not debounced was not seen at all.
    for name in ("on", "both", "never", "steady", "all"):
        eye = read(sim, f"photo_eyes/{name}/")
        assert (eye["rose"], eye["fell"]) == pytest.approx((rose, fell), abs=1e-6), name
    assert read(sim, "photo_eyes/deaf/")["edges"] == 0.0


def test_a_stuck_eye_tells_nothing_else_until_it_is_right_again() -> None:
    """Blocked from tick 48 to 73. The eye is stuck from the tick at which the fault acts, until the fault ends."""
    x = 0.3006
    sim = eye_line(photo_eyes={name: across(x) for name in ("on", "off", "good")})
    sim.inject("photo_eyes/on/stuck_on", 1.0)
    levels = {name: values[:] for name, values in trace(sim, 20, "on", "off", "good").items()}
    sim.inject("photo_eyes/off/stuck_off", 1.0)
    for name, values in trace(sim, 40, "on", "off", "good").items():
        levels[name] += values[1:]
    sim.inject("photo_eyes/on/stuck_on", 0.0)
    sim.inject("photo_eyes/off/stuck_off", 0.0)
    for name, values in trace(sim, 60, "on", "off", "good").items():
        levels[name] += values[1:]
    assert changes(levels["good"]) == [48, 74]
    assert changes(levels["on"]) == [1, 74]
    assert changes(levels["off"]) == [61, 74]
    assert read(sim)["photo_eyes/off/rose"] == pytest.approx(0.6)


def test_a_late_eye_is_late_by_so_much() -> None:
    """Two beams are at one place. Edges of the late one come 0.123 s later.

    No edge overtakes another when the fault ends.
    """
    sim = eye_line(photo_eyes={"late": across(0.3006), "good": across(0.3006)})
    sim.inject("photo_eyes/late/delay", 0.123)
    sim.advance(71)
    late, good = read(sim, "photo_eyes/late/"), read(sim, "photo_eyes/good/")
    assert late["rose"] - good["rose"] == pytest.approx(0.123, abs=1e-9)
    sim.inject("photo_eyes/late/delay", 30.0)
    sim.advance(10)
    sim.inject("photo_eyes/late/delay", 0.0)
    sim.advance(100)
    assert read(sim)["photo_eyes/late/blocked"] == 1.0
    assert read(sim)["photo_eyes/good/blocked"] == 0.0


def test_chatter_has_its_rate_and_is_drawn_from_the_seed() -> None:
    """There are two edges per cycle. Each eye has separate draws, and another seed gives others."""

    def edges(seed: int) -> list[tuple[float, ...]]:
        sim = eye_line(seed=seed, photo_eyes={"one": across(1.5), "other": across(1.5), "good": across(1.5)})
        for name in ("one", "other"):
            sim.inject(f"photo_eyes/{name}/chatter", 25.0)
        sim.advance(200)
        return [tuple(read(sim, f"photo_eyes/{name}/").values()) for name in ("one", "other", "good")]

    one, other, good = edges(1)
    assert 2 * 25 * 2 * 0.9 < one[3] < 2 * 25 * 2 * 1.1
    assert good == (0.0, 0.0, 0.0, 0.0)
    assert one != other
    assert edges(1) == [one, other, good]
    assert edges(2)[0] != one


def test_faults_out_of_range_are_refused() -> None:
    sim = eye_line(photo_eyes={"eye": across(0.3)})
    sim.inject("photo_eyes/eye/chatter", -1.0)
    sim.inject("photo_eyes/eye/stuck_on", 0.5)
    sim.inject("photo_eyes/nobody/stuck_on", 1.0)
    sim.advance()
    reasons = [outcome.reason for outcome in sim.take_outcomes()]
    assert reasons[:2] == [
        "photo_eyes/eye/chatter: -1 given, expected 0 to 1000 Hz",
        "photo_eyes/eye/stuck_on: 0.5 given, expected 0 or 1",
    ]
    assert reasons[2].startswith("photo_eyes/nobody/stuck_on: no such fault, expected one of photo_eyes/eye/stuck_on")


def test_a_scene_without_sensors_has_none_and_does_nothing_for_them() -> None:
    bare, full = eye_line(), eye_line(photo_eyes={"eye": across(0.3)})
    assert {name.split("/")[0] for name in bare.process_image.signal_names} == {"belts", "alarm_counts"}
    assert bare.process_image.faults == ()
    assert {device.name.split("/")[0] for device in bare._line._devices} == {"belts", "alarms"}
    for sim in (bare, full):
        sim.advance(100)
    assert bare.state_hash() == full.state_hash()


def test_a_timer_ignores_what_is_too_short_and_keeps_exact_times() -> None:
    timer = Timer(on=0.03, off=0.05)
    timer.start(False)
    short, long = [(0.10, True), (0.12, False)], [(0.20, True), (0.23, False)]
    assert timer.follow(short, 0.19) == []
    assert timer.follow(long[:1], 0.229) == []
    assert timer.follow([], 0.23) == [(0.23, True)]
    assert timer.follow(long[1:], 0.25) == []
    # A pulse exactly as long as the delay counts; one that ends as late as it would ripen still lets it ripen first.
    assert timer.follow([(0.26, True), (0.27, False)], 0.31) == []
    assert timer.follow([], 0.4) == [(0.32, False)]
    at_once = Timer(0.0, 0.0)
    assert at_once.follow([(0.5, True), (0.5, False), (0.7, True)], 1.0) == [(0.5, True), (0.5, False), (0.7, True)]
