# SPDX-License-Identifier: Apache-2.0
"""Tracked reject, while the belt's speed changes 4 : 1."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from itertools import accumulate

import pytest
from control.scans import LENGTH, Beam, Scans, edges_of
from facts import stating

from conveyor_sim.control import ControlError
from conveyor_sim.control.reject import TrackedReject

DIAMETER, DISTANCE, STROKE, PULSES = 0.06, 1.3, 0.03, 1000.0  # m, m, m, 1/m
FIRE, SEEN = "machines/reject/fire", "photo_eyes/look/rose"


Speed = Callable[[float], float]


def up_and_down(time: float) -> float:
    """Return a speed between 0.25 and 1 m/s, up and down in 1.5 s."""
    return 0.625 + 0.375 * math.cos(2.0 * math.pi * time / 3.0)


def stop_and_go(time: float) -> float:
    """Return a speed that stops and goes, m/s."""
    return 0.5 if time % 2.0 < 1.2 else 0.0


def fired_at(fronts: list[float], bad: set[int], speed: Speed, late: int) -> list[tuple[float, float, float]]:
    """Return start and end travel (m) and initial speed (m/s) of each stroke.

    late: scans from a bottle's rise to the inspection's verdict.
    """
    controller = TrackedReject("belt", "machines/look/bad", SEEN, FIRE, DISTANCE, STROKE, PULSES)
    scans, beam, edges = Scans(controller), Beam("look"), edges_of(fronts, DIAMETER)
    travel, verdicts, rises, fired = 0.0, [0] * (late + 1), 0, list[tuple[float, float, float]]()
    while travel < fronts[-1] + DISTANCE + 1.0:
        counts = {"machines/look/bad": float(verdicts[-1 - late])}
        now = speed(scans.time)
        signals = {"belts/belt/pulses": float(int(travel * PULSES)), "belts/belt/speed": now, **counts}
        before = travel
        firing = scans.scan({**signals, **beam.signals()})[FIRE]
        travel += LENGTH * now
        if now:
            beam.pass_by(edges, before, travel, scans.time, LENGTH)
        rises = sum(front <= travel for front in fronts)
        verdicts.append(sum(number < rises for number in bad))
        if firing and fired and fired[-1][1] == before:
            fired[-1] = (fired[-1][0], travel, fired[-1][2])
        elif firing:
            fired.append((before, travel, now))
    return fired


@pytest.mark.parametrize(("speed", "late"), [(up_and_down, 0), (up_and_down, 4), (stop_and_go, 0)])
def test_every_bad_bottle_is_hit_where_it_should_be_and_no_other(speed: Speed, late: int) -> None:
    numbers = random.Random(5)
    fronts = list(accumulate(numbers.uniform(0.11, 0.25) for _ in range(150)))
    bad = set(numbers.sample(range(150), 60))
    fired = fired_at(fronts, bad, speed, late)
    assert len(fired) == len(bad)
    for (start, end, speed_then), number in zip(fired, sorted(bad), strict=True):
        # Half a scan, a pulse, and what the speed changed while the inspection thought.
        assert start + LENGTH * speed_then - fronts[number] == pytest.approx(
            DISTANCE, abs=0.5 * LENGTH * speed_then + 0.002
        )
        assert end - start == pytest.approx(STROKE, abs=2.0 * LENGTH)


def test_the_response_is_led_by_the_belts_speed() -> None:
    controller = TrackedReject("belt", "machines/look/bad", SEEN, FIRE, 1.0, 0.02, 1000.0, response=0.2)
    signals = {"belts/belt/speed": 0.5, "machines/look/bad": 0.0, "photo_eyes/look/rose": 0.0}
    scans = Scans(controller, **signals, **{"belts/belt/pulses": 0.0})
    scans.scan({})
    scans.scan({"machines/look/bad": 1.0, "belts/belt/pulses": 5.0})
    firing = [pulses for pulses in range(10, 1100, 5) if scans.scan({"belts/belt/pulses": pulses})[FIRE]]
    # Seen at 0, hit at 1000: 100 pulses after the end of the scan, which are 5.
    assert firing == [895, 900, 905, 910]


def test_what_was_found_before_the_first_scan_is_not_tracked() -> None:
    controller = TrackedReject("belt", "machines/look/bad", SEEN, FIRE, 0.1, 0.02, 1000.0)
    signals = {"belts/belt/speed": 0.5, "machines/look/bad": 3.0, "photo_eyes/look/rose": 0.0}
    scans = Scans(controller, **signals)
    assert not any(scans.scan({"belts/belt/pulses": 5.0 * number})[FIRE] for number in range(100))


def test_a_stroke_of_nothing_is_refused() -> None:
    with pytest.raises(ControlError, match=stating("stroke", "0", "more than 0")):
        TrackedReject("belt", "machines/look/bad", SEEN, FIRE, 1.0, 0.0, 1000.0)
