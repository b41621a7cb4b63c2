# SPDX-License-Identifier: Apache-2.0
"""Watchdogs: a belt without a command for its time-out stops, once, until the next command."""

from scenes import base, belt, bottle, simulation

from conveyor_sim.line.devices.setpoint import Watchdog
from conveyor_sim.simulation import Simulation

NAME = "belts/watched/cmd_speed"


def watched(timeout: float = 0.05) -> Simulation:
    return simulation(
        tick=0.01,
        accuracy={"per_tick": 10},
        base=base(0.4),
        belts={
            "watched": belt(0.2, (0.0, 0.0), 1.0, 1.0, watchdog=timeout),
            "free": belt(0.3, (2.0, 0.0), 1.0, 1.0),
        },
        bottles=[bottle(0.5, 0.5)],
    )


def speeds(sim: Simulation, ticks: int) -> list[float]:
    """Return the speed of the watched belt after each tick."""
    found = []
    for _ in range(ticks):
        sim.advance()
        found.append(float(sim.belts().actual[0]))
    return found


def test_the_belt_stops_at_the_first_tick_past_the_time_out() -> None:
    """With 0.05 s, the belt still runs in ticks 0 to 4.

    The stop is reported once, as the result of a command by the line.
    """
    sim = watched()
    assert speeds(sim, 8) == [0.2] * 5 + [0.0] * 3
    (outcome,) = sim.take_outcomes()
    assert (outcome.tick, outcome.source, outcome.names, outcome.values) == (5, "watchdog", (NAME,), (0.0,))
    assert outcome.accepted
    assert sim.belts().commanded.tolist() == [0.0, 0.3]


def test_commands_keep_it_running_and_revive_it() -> None:
    sim = watched()
    for _ in range(6):
        sim.command([NAME], [0.4])
        assert speeds(sim, 4) == [0.4] * 4
    assert speeds(sim, 3) == [0.4, 0.0, 0.0]
    sim.command([NAME], [0.1])
    assert speeds(sim, 7) == [0.1] * 5 + [0.0] * 2
    sources = [outcome.source for outcome in sim.take_outcomes()]
    assert sources == ["commands"] * 6 + ["watchdog", "commands", "watchdog"]


def test_a_refused_command_or_one_for_another_belt_does_not_feed_it() -> None:
    sim = watched()
    for _ in range(5):
        sim.command([NAME], [99.0])
        sim.command(["belts/free/cmd_speed"], [0.1])
        sim.advance()
    assert speeds(sim, 1) == [0.0]


def test_a_command_at_the_last_moment_is_in_time() -> None:
    """Commands come before watchdogs in a scan."""
    sim = watched()
    sim.advance(5)
    sim.command([NAME], [0.2])
    assert speeds(sim, 5) == [0.2] * 5


def test_a_time_out_between_ticks_counts_up() -> None:
    """Seven milliseconds are one tick of ten; 0.051 s are six."""
    assert speeds(watched(0.007), 2) == [0.2, 0.0]
    assert speeds(watched(0.051), 7) == [0.2] * 6 + [0.0]


def test_the_watchdog_by_itself() -> None:
    dog = Watchdog(timeout_ticks=3)
    assert [dog.trips(tick) for tick in range(6)] == [False, False, False, True, False, False]
    dog.command(6)
    assert [dog.trips(tick) for tick in range(6, 11)] == [False, False, False, True, False]
