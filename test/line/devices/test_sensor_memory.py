# SPDX-License-Identifier: Apache-2.0
"""Memory of sensors: a run continues from a checkpoint, or in other portions, with the same bits."""

from __future__ import annotations

from pathlib import Path

from line.devices.eye_line import across, eye_line, read

from conveyor_sim.simulation import Simulation


def sensing() -> Simulation:
    """Return a line with all kinds of sensors, with faults and delays in progress."""
    region = [[0.3, -0.2], [0.9, -0.2], [0.9, 0.2], [0.3, 0.2]]
    sim = eye_line(
        xs=(0.0, -0.131, -0.4),
        photo_eyes={
            "plain": across(0.3),
            "slow": across(0.3, debounce=0.05, on_delay=0.06, off_delay=0.1),
            "late": across(0.3, on_delay=0.02),
            "mad": across(0.3, debounce=0.01),
        },
        zones={"zone": {"region": region, "full_at": 2}},
        counters={"line": across(0.5)},
        indicators={
            "exit": {"counter": "line", "belt": "belt", "zone": "zone", "jam_time": 0.1, "starved_time": 0.3,
                     "window": 0.5, "downstream": "plate", "backup": "zone"},
        },
    )  # fmt: skip
    sim.inject("photo_eyes/late/delay", 0.07)
    sim.inject("photo_eyes/mad/chatter", 60.0)
    sim.inject("zones/zone/offset", 1.0)
    return sim


def rows(sim: Simulation, end: int) -> list[bytes]:
    """Return the signals after each tick."""
    found = []
    while sim.tick < end:
        sim.advance()
        found.append(sim.signals().tobytes())
    return found


def test_a_checkpoint_in_the_middle_of_edges_goes_on_with_the_same_bits(tmp_path: Path) -> None:
    """At tick 50 the beam has been broken for 0.03 s: debounce, delay and on-delay are in progress."""
    sim = sensing()
    rows(sim, 50)
    shown = read(sim)
    assert (shown["photo_eyes/plain/blocked"], shown["photo_eyes/slow/edges"]) == (1.0, 0.0)
    assert shown["photo_eyes/late/edges"] == 0.0 and shown["photo_eyes/mad/edges"] > 0.0
    sim.save(tmp_path / "checkpoint")
    loaded = Simulation.load(tmp_path / "checkpoint")
    assert rows(loaded, 220) == rows(sim, 220)
    shown = read(sim)
    assert shown["counters/line/forward"] == 3.0
    assert shown["photo_eyes/slow/edges"] == 4.0 and shown["photo_eyes/late/edges"] == 6.0


def test_however_a_run_is_divided_it_has_the_same_bits() -> None:
    one, many = sensing(), sensing()
    many.advance(7)
    many.advance(93)
    assert rows(one, 100)[-1] == many.signals().tobytes()
