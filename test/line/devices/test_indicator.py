# SPDX-License-Identifier: Apache-2.0
"""Indicators of an exit: a jam is distinguished from a moving queue, a stop downstream, and a lack of bottles."""

from __future__ import annotations

from typing import Any

import pytest
from line.devices.eye_line import across, eye_line, read
from scenes import RADIUS

from conveyor_sim.simulation import Simulation

PLATE, BELT = "belts/plate/cmd_speed", "belts/belt/cmd_speed"
PITCH = 2.0 * RADIUS


def exit_line(
    count: int, first: float = 1.903, more: dict[str, Any] | None = None, speed: float = 0.5, pitch: float = 2.0 * PITCH
) -> Simulation:
    """Return a line with a row of bottles that leave over x = 2.3, on the plate.

    Bottles on a stopped plate do not pass.
    """
    return eye_line(
        speed,
        xs=tuple(first - pitch * n for n in range(count)),
        counters={"out": across(2.3)},
        zones={
            "waiting": {"region": [[1.0, -0.5], [2.3, -0.5], [2.3, 0.5], [1.0, 0.5]]},
            "behind": {"region": [[2.3, -0.5], [3.0, -0.5], [3.0, 0.5], [2.3, 0.5]], "full_at": 5},
        },
        indicators={
            "exit": {
                "counter": "out",
                "belt": "belt",
                "zone": "waiting",
                "jam_time": 1.0,
                "window": 2.0,
                **(more or {}),
            }
        },
    )


def history(sim: Simulation, ticks: int, *names: str) -> list[tuple[float, ...]]:
    """Return the signals of the exit after each tick."""
    found = []
    for _ in range(ticks):
        sim.advance()
        signals = read(sim, "indicators/exit/")
        found.append(tuple(signals[name] for name in names))
    return found


def test_nose_to_tail_flow_is_no_jam_and_has_its_rate() -> None:
    """One bottle every 0.26 s is 3.846 per second, so a window of 2 s has 7 or 8 of them."""
    sim = exit_line(25, pitch=PITCH)
    jams, flows = zip(*history(sim, 600, "jam", "flow"), strict=True)
    assert not any(jams)
    assert set(flows[350:]) == {7.0 * 1800.0, 8.0 * 1800.0}
    assert sum(flows[350:600]) / 250 == pytest.approx(3600.0 * 0.5 / PITCH, rel=0.02)


def test_bottles_that_wait_and_do_not_pass_while_the_belt_runs_are_a_jam() -> None:
    """The plate stops under them at tick 100. The jam is reported one second after the passage at tick 80.

    Stopping the belt does not clear the jam, the next passage does.
    """
    sim = exit_line(4)
    assert not any(jam for (jam,) in history(sim, 100, "jam"))
    sim.command([PLATE], [0.0])
    jams = [jam for (jam,) in history(sim, 130, "jam")]
    assert read(sim)["counters/out/forward"] == 1.0
    assert jams.index(1.0) == 79 and all(jams[79:])
    sim.command([BELT], [0.0])
    assert all(jam for (jam,) in history(sim, 30, "jam"))
    sim.command([BELT, PLATE], [0.5, 0.5])
    passed, jams = read(sim)["counters/out/forward"], []
    while read(sim)["counters/out/forward"] == passed:
        jams += [jam for (jam,) in history(sim, 1, "jam")]
    assert len(jams) > 1 and all(jams[:-1]) and not jams[-1]


def test_the_time_of_a_jam_is_exact_in_ticks() -> None:
    """A bottle stands in the zone, on the plate, while the belt runs, for one second. A stop restarts that time."""
    sim = exit_line(1, first=2.28, speed=0.0)
    sim.command([BELT], [0.1])
    jams = [jam for (jam,) in history(sim, 101, "jam")]
    assert jams.index(1.0) == 99
    sim = exit_line(1, first=2.28, speed=0.0)
    sim.command([BELT], [0.1])
    sim.advance(99)
    sim.command([BELT], [0.0])
    sim.advance(5)
    sim.command([BELT], [0.1])
    assert [jam for (jam,) in history(sim, 101, "jam")].index(1.0) == 99


@pytest.mark.parametrize("more", [{"downstream": "plate"}, {"backup": "behind"}], ids=["stands", "full"])
def test_a_stop_downstream_blocks_and_is_no_jam(more: dict[str, str]) -> None:
    """Bottles wait at a stopped plate, or before a full zone. Blocked is reported at once, until they move on."""
    sim = exit_line(4, more=more)
    assert not any(any(row) for row in history(sim, 70, "blocked", "jam"))
    sim.command([PLATE], [0.0])
    if "backup" in more:
        sim.inject("zones/behind/offset", 20.0)
    assert history(sim, 150, "blocked", "jam") == [(1.0, 0.0)] * 150
    sim.command([BELT], [0.0])  # held back because of that: no longer wants to, so it is not blocked
    assert history(sim, 1, "blocked", "jam") == [(0.0, 0.0)]
    sim.command([BELT, PLATE], [0.5, 0.5])
    if "backup" in more:
        sim.inject("zones/behind/offset", 0.0)
    assert not any(any(row) for row in history(sim, 80, "blocked", "jam"))


def test_an_exit_whose_belt_runs_without_bottles_is_starved() -> None:
    """Starved begins after the last bottle has left.

    A stopped belt is not starved. Without downstream devices, no signal reports blocked.
    """
    sim = exit_line(1, first=2.25, more={"starved_time": 0.5})
    assert set(read(sim, "indicators/exit/")) == {"flow", "jam", "starved"}
    left = round((2.3 - 2.25) / 0.5 / 0.01)
    starved = [value for (value,) in history(sim, 100, "starved")]
    assert starved.index(1.0) + 1 in (left + 49, left + 50, left + 51)
    assert all(starved[starved.index(1.0) :])
    sim.command([BELT], [0.0])
    assert history(sim, 2, "starved") == [(0.0,), (0.0,)]


def test_a_bottle_that_shakes_on_the_line_is_no_flow() -> None:
    """Three times forward and twice back is one passage."""
    sim = exit_line(1, first=2.25, more={"window": 100.0})
    for speed, ticks in ((0.5, 25), (-0.5, 60), (0.5, 60), (-0.5, 60), (0.5, 60)):
        sim.command([PLATE], [speed])
        sim.advance(ticks)
    assert read(sim, "counters/out/") == {"forward": 3.0, "backward": 2.0}
    assert read(sim)["indicators/exit/flow"] == 36.0
