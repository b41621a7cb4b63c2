# SPDX-License-Identifier: Apache-2.0
"""Drives: commands, trips and reset, and the count of the encoder."""

import math
from itertools import pairwise
from typing import Any

import pytest
from facts import missing
from scenes import base, belt, bottle, simulation

from conveyor_sim.line.devices.drive import Ramp
from conveyor_sim.simulation import Simulation


def driven(**drive: Any) -> Simulation:
    """Return a belt at 0.5 m/s with a drive of 1 m/s^2 and 1000 pulses per metre, and a bottle on it."""
    return simulation(
        accuracy={"per_tick": 10},
        base=base(0.4),
        belts={"one": belt(0.5, drive={"acceleration": 1.0, "pulses_per_metre": 1000.0, **drive}, watchdog=5.0)},
        bottles=[bottle(0.0, 0.0, 0.5)],
    )


def signal(sim: Simulation, name: str) -> float:
    """Return the present value of a signal of the belt."""
    return float(sim.signals()[sim.process_image.signal_names.index(f"belts/one/{name}")])


def told(sim: Simulation, **values: float) -> Simulation:
    """Send commands to the belt, and return the simulation."""
    sim.command([f"belts/one/{name}" for name in values], list(values.values()))
    return sim


def states(sim: Simulation) -> tuple[float, float, float]:
    return signal(sim, "running"), signal(sim, "at_speed"), signal(sim, "fault")


def test_the_engine_sees_the_ramped_speed() -> None:
    """A bottle that sticks to the belt has the acceleration of the drive: 1 m/s^2 is less than mu g."""
    sim = told(driven(), cmd_speed=1.0)
    sim.advance(30)
    assert signal(sim, "speed") == pytest.approx(0.8)
    assert sim.belts().commanded[0] == 1.0
    assert sim.bottles().vx[0] == pytest.approx(0.8, abs=0.01)  # creep under 1 m/s^2, about v_lim / 4
    assert states(sim) == (1.0, 0.0, 0.0)
    sim.advance(20)
    assert (signal(sim, "speed"), *states(sim)) == (1.0, 1.0, 1.0, 0.0)


def test_run_and_reverse() -> None:
    sim = told(driven(), run=0.0)
    sim.advance(50)
    assert (signal(sim, "speed"), *states(sim)) == (0.0, 0.0, 1.0, 0.0)
    told(sim, run=1.0, reverse=1.0).advance(50)
    assert (signal(sim, "speed"), *states(sim)) == (-0.5, 1.0, 1.0, 0.0)


def test_the_encoder_counts_travel_and_counts_back() -> None:
    sim = driven()
    sim.advance(100)
    assert signal(sim, "pulses") == 500.0
    told(sim, reverse=1.0).advance(200)
    # On for 0.5 s, back for 0.5 s, then 1 s at -0.5 m/s; a ramp is held for a tick.
    assert signal(sim, "pulses") == pytest.approx(0.0, abs=5.0)


def test_a_trip_stops_it_until_it_is_mended_and_reset() -> None:
    sim = driven()
    sim.inject("belts/one/trip", 1.0)
    sim.advance(60)
    assert (signal(sim, "speed"), *states(sim)) == (0.0, 0.0, 1.0, 1.0)
    told(sim, reset=1.0).advance(1)
    assert signal(sim, "fault") == 1.0, "it can't be reset while the fault lasts"
    sim.inject("belts/one/trip", 0.0)
    sim.advance(10)
    assert signal(sim, "fault") == 1.0, "it does not start by itself"
    told(sim, reset=1.0).advance(1)
    assert signal(sim, "fault") == 1.0, "a reset that is held does not rise"
    told(sim, reset=0.0).advance(1)
    told(sim, reset=1.0).advance(60)
    assert (signal(sim, "speed"), *states(sim)) == (0.5, 1.0, 1.0, 0.0)
    told_outcomes = [outcome for outcome in sim.take_outcomes() if outcome.source == "fault"]
    assert [(outcome.tick, outcome.names, outcome.accepted) for outcome in told_outcomes] == [
        (0, ("belts/one/trip",), True),
        (61, ("belts/one/trip",), True),
    ]


def test_a_silent_controller_stops_it_by_its_ramp() -> None:
    sim = driven()
    sim.advance(501)
    assert sim.belts().commanded[0] == 0.0
    assert 0.4 < signal(sim, "speed") < 0.5
    sim.advance(60)
    assert signal(sim, "speed") == 0.0


def test_faults_are_no_commands_and_commands_no_faults() -> None:
    sim = driven()
    sim.command(["belts/one/trip"], [1.0])
    sim.inject("belts/one/run", 0.0)
    sim.advance()
    reasons = [outcome.reason for outcome in sim.take_outcomes()]
    assert reasons[0].startswith("belts/one/trip: no such command, expected one of belts/one/cmd_speed, ")
    assert missing(reasons[1], "belts/one/run", "fault", "belts/one/trip") == []
    with pytest.raises(ValueError, match="expected another: fault, watchdog and arrival are the line's"):
        sim.command(["belts/one/run"], [0.0], source="fault")


def test_a_belt_without_a_drive_has_none_of_it() -> None:
    sim = simulation(base=base(0.4), belts={"one": belt(0.5)})
    named = [tag.name for tag in sim.process_image.signals if tag.device != "alarms"]
    assert named == ["belts/one/speed", "belts/one/bottles", "belts/one/mode"]
    assert sim.process_image.command_names == ("belts/one/cmd_speed",)
    assert sim.process_image.faults == ()


DT = 0.01


def course(ramp: Ramp, setpoint: float, limit: float, jerk: float | None) -> list[float]:
    """Return the speeds up to the setpoint, the first one included."""
    speeds = [ramp.value]
    while ramp.value != setpoint:
        speeds.append(ramp.approach(setpoint, limit, jerk, DT))
        assert len(speeds) < 10_000
    return speeds


@pytest.mark.parametrize(("start", "end"), [(0.0, 1.0), (1.0, 0.2), (-0.5, 0.7)])
def test_without_a_limit_of_jerk_it_is_a_straight_line(start: float, end: float) -> None:
    speeds = course(Ramp(start), end, 0.5, None)
    assert len(speeds) - 1 == math.ceil(round(abs(end - start) / (0.5 * DT), 9))
    assert speeds[10] - start == pytest.approx(math.copysign(10 * 0.5 * DT, end - start))


@pytest.mark.parametrize("jerk", [1.0, 5.0, 40.0])
@pytest.mark.parametrize(("start", "end"), [(0.0, 1.0), (0.6, -0.6)])
def test_an_s_curve(jerk: float, start: float, end: float) -> None:
    limit, way = 0.8, abs(end - start)
    speeds = course(Ramp(start), end, limit, jerk)
    rates = [(after - before) / DT for before, after in pairwise([start, *speeds, end])]
    assert max(map(abs, rates)) <= limit * (1 + 1e-12)
    # The last step, which ends on the setpoint, may be shorter.
    assert max(abs(after - before) for before, after in pairwise(rates)) <= jerk * DT * (1 + 1e-6)
    assert all(min(start, end) <= speed <= max(start, end) for speed in speeds)
    closed = way / limit + limit / jerk if limit**2 < jerk * way else 2.0 * math.sqrt(way / jerk)
    assert (len(speeds) - 1) * DT == pytest.approx(closed, abs=3 * DT)


def test_a_setpoint_that_changes_on_the_way_is_met_within_the_limits() -> None:
    ramp, before = Ramp(0.0), 0.0
    for tick in range(400):
        speed = ramp.approach(1.0 if tick < 60 else 0.1, 1.0, 4.0, DT)
        assert abs(speed - before) <= 1.0 * DT * (1 + 1e-12)
        before = speed
    assert (ramp.value, ramp.acceleration) == (0.1, 0.0)
