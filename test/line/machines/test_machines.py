# SPDX-License-Identifier: Apache-2.0
"""Machines that feed, take, inspect and reject bottles; spills."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from facts import missing
from line.machines.machine_line import END, line, signals, sink, source
from scenes import belt

from conveyor_sim.errors import SceneError
from conveyor_sim.simulation import Simulation


def test_a_source_keeps_its_rate_and_a_sink_takes_in_order() -> None:
    """The period of 1/3 s is no whole number of ticks; the mean rate is still exact."""
    sim = line(machines={"filler": source(3.0), "packer": sink(3.0)})
    sim.advance(1000)
    now = signals(sim)
    assert now["machines/filler/produced"] == 30  # the first one after a third of a second
    # 1.75 m at 0.5 m/s: the first one comes after another 3.5 s.
    assert now["machines/packer/taken"] == pytest.approx((10.0 - 3.8) * 3.0, abs=1)
    assert sim.bottles().id.tolist() == list(range(int(now["machines/packer/taken"]), 30))
    assert sim.counts.fed == 30
    assert sim.counts.removed == now["machines/packer/taken"]


def test_a_rate_can_be_commanded_within_its_limit() -> None:
    sim = line(machines={"filler": source(2.0, rate_limit=3.0)})
    sim.advance(100)
    sim.command(["machines/filler/rate"], [3.0])
    sim.advance(100)
    assert signals(sim)["machines/filler/produced"] == 2 + 3
    sim.command(["machines/filler/rate"], [3.1])
    sim.command(["machines/filler/rate"], [0.0])
    sim.advance(100)
    refused = [outcome.reason for outcome in sim.take_outcomes() if not outcome.accepted]
    assert missing(refused[0], "machines/filler/rate", "3.1", "0 to 3 1/s") == []
    assert signals(sim)["machines/filler/produced"] == 5


def test_a_stopped_packer_blocks_the_filler() -> None:
    """No bottle is lost: each one fed is on the line or was taken."""
    sim = line(machines={"filler": source(), "packer": sink()})
    sim.advance(1000)
    assert signals(sim)["machines/filler/blocked_time"] == 0.0
    sim.inject("machines/packer/stop", 1.0)
    sim.advance(1500)
    held = signals(sim)
    assert held["machines/packer/running"] == 0.0
    assert (held["machines/filler/blocked"], held["machines/filler/running"]) == (1.0, 0.0)
    blocked = held["machines/filler/blocked_time"]
    assert sim.counts.present == (2.0 - 0.065) // 0.13 + 1  # from the place of the source to a radius off the rail
    sim.advance(100)
    assert signals(sim)["machines/filler/blocked_time"] - blocked == pytest.approx(1.0)
    sim.inject("machines/packer/stop", 0.0)
    sim.advance(1000)
    now = signals(sim)
    assert now["machines/packer/taken"] - held["machines/packer/taken"] == pytest.approx(20, abs=1)
    assert now["machines/filler/produced"] - now["machines/packer/taken"] == sim.counts.present


def test_a_packer_without_bottles_is_starved() -> None:
    sim = line(machines={"filler": source(), "packer": sink(4.0)})
    sim.command(["machines/filler/run"], [0.0])
    sim.advance(200)
    now = signals(sim)
    assert (now["machines/packer/starved"], now["machines/packer/running"]) == (1.0, 1.0)
    assert now["machines/packer/starved_time"] == pytest.approx(1.99)
    sim.command(["machines/packer/run"], [0.0])
    sim.advance(100)
    now = signals(sim)
    assert (now["machines/packer/starved"], now["machines/packer/starved_time"]) == (0.0, pytest.approx(2.0))


def test_an_inspection_sees_the_bad_ones_when_they_pass() -> None:
    """Every third bottle is bad. At 0.5 m/s it passes 1 m from its entry after 2 s, between two ticks."""
    looking = {"kind": "inspection", "from": [1.003, -0.1], "to": [1.003, 0.1]}
    sim = line(machines={"filler": source(bad_every=3), "eye": looking, "packer": sink()})
    sim.advance(249)
    assert signals(sim)["machines/eye/count"] == 0
    sim.advance(351)
    now = signals(sim)
    # Fed at 0.5, 1, 1.5, ...: the eighth passes after 4 s + 1.003 / 0.5 s.
    assert (now["machines/eye/count"], now["machines/eye/bad"]) == (7, 2)
    assert now["machines/eye/time"] == pytest.approx(3.5 + 2.006, abs=1e-4)
    assert now["machines/eye/bad_time"] == pytest.approx(3.0 + 2.006, abs=1e-4)
    sim.advance(450)
    now = signals(sim)
    assert now["machines/packer/taken_bad"] == now["machines/packer/taken"] // 3


def test_the_share_of_bad_bottles_comes_from_the_seed() -> None:
    """There are 30 in a hundred, within 4 standard deviations.

    Equal seeds give equal bottles, others do not. Motion does not change.
    """
    looking = {"kind": "inspection", "from": [0.1, -0.1], "to": [0.1, 0.1]}
    feed = {"bottle": "bottle", "position": [0.0, 0.0], "direction": 0.0, "speed": 0.5, "rate": 3.0}
    out = {"out": {"region": END}}
    runs = []
    for seed, share in ((1, 0.3), (1, 0.3), (2, 0.3), (1, 0.0)):
        sim = line(machines={"eye": looking}, infeeds={"in": {**feed, "bad_share": share}}, outfeeds=out, seed=seed)
        bad = []
        for _ in range(34):
            sim.advance(100)
            bad.append(signals(sim)["machines/eye/bad"])
        runs.append((bad, sim.state_hash()))
    assert abs(runs[0][0][-1] - 30) < 4 * np.sqrt(100 * 0.3 * 0.7)
    assert runs[0] == runs[1]
    assert runs[0][0] != runs[2][0]
    assert runs[3][0][-1] == 0
    assert len({state for _, state in runs}) == 1


def test_a_reject_hits_the_bottle_before_it() -> None:
    """Bottles are 0.25 m apart, each in front of it for 0.1 m / 0.5 m/s.

    The second one is hit, the gap after it is not.
    """
    region = [[0.95, -0.1], [1.05, -0.1], [1.05, 0.1], [0.95, 0.1]]
    thrower = {"kind": "reject", "region": region, "delay": 0.05}
    sim = line(machines={"filler": source(bad_every=2), "thrower": thrower})
    sim.advance(295)  # the second, fed at 1 s, is 0.975 m along
    fire(sim)
    sim.advance(10)
    now = signals(sim)
    assert (now["machines/thrower/rejected"], now["machines/thrower/rejected_bad"]) == (1, 1)
    assert 1 not in sim.bottles().id
    sim.advance(15)  # the third is at 0.85 m
    fire(sim)
    sim.advance(10)
    now = signals(sim)
    assert (now["machines/thrower/rejected"], now["machines/thrower/missed"]) == (1, 1)
    sim.inject("machines/thrower/stop", 1.0)
    sim.advance(20)  # the third is at 1 m
    fire(sim)
    sim.advance(10)
    assert signals(sim)["machines/thrower/rejected"] == 1
    assert sim.counts.fed - sim.counts.present == sim.counts.removed == 1


def fire(sim: Simulation) -> None:
    """Start one stroke."""
    for value in (1.0, 0.0):
        sim.command(["machines/thrower/fire"], [value])
        sim.advance()


def test_a_spill_drops_a_bottle_as_soon_as_there_is_room() -> None:
    sim = line(machines={"filler": source()}, spills={"mess": {"bottle": "bottle", "position": [0.0, 0.0], "count": 2}})
    sim.advance(50)
    sim.inject("spills/mess/drop", 1.0)
    sim.advance()
    assert signals(sim)["spills/mess/dropped"] == 0, "the first bottle of the filler stands there"
    sim.advance(30)
    assert signals(sim)["spills/mess/dropped"] == 1
    for value in (0.0, 1.0, 0.0, 1.0):
        sim.inject("spills/mess/drop", value)
        sim.advance(40)
    assert signals(sim)["spills/mess/dropped"] == 2, "and no more than it has"
    assert sim.counts.fed == signals(sim)["machines/filler/produced"] + 2


def test_a_run_goes_on_from_a_checkpoint_with_the_same_bits(tmp_path: Path) -> None:
    """Strokes, cycles, waiting bottles and ramps are in progress; the run is divided in several ways."""
    region = [[0.95, -0.1], [1.05, -0.1], [1.05, 0.1], [0.95, 0.1]]
    machines = {
        "filler": source(3.0, bad_share=0.4),
        "eye": {"kind": "inspection", "from": [0.5, -0.1], "to": [0.5, 0.1]},
        "thrower": {"kind": "reject", "region": region, "delay": 0.05},
        "packer": sink(1.3),
    }
    drive = {"acceleration": 0.7, "jerk": 3.0, "pulses_per_metre": 500.0}
    sim = line(machines=machines, belts={"one": belt(0.5, (-0.2, -0.1), 2.2, 0.2, drive=drive)})
    sim.advance(680)
    sim.command(["belts/one/cmd_speed", "machines/thrower/fire"], [0.3, 1.0])
    sim.inject("machines/packer/stop", 1.0)
    sim.advance(3)
    sim.inject("machines/packer/stop", 0.0)
    sim.save(tmp_path / "checkpoint")
    loaded = Simulation.load(tmp_path / "checkpoint")
    sim.advance(300)
    for _ in range(100):
        loaded.advance(3)
    assert loaded.full_state_hash() == sim.full_state_hash()
    assert loaded.signals().tolist() == sim.signals().tolist()
    assert loaded.take_outcomes() == sim.take_outcomes()


def test_bad_bottles_are_those_that_the_scene_numbers() -> None:
    """Bottles are counted from 1 in order of entry, from an infeed and from a source."""
    looking = {"kind": "inspection", "from": [0.3, -0.1], "to": [0.3, 0.1]}
    feed = {
        "bottle": "bottle",
        "position": [0.0, 0.0],
        "direction": 0.0,
        "speed": 0.5,
        "rate": 2.0,
        "bad_at": [2, 3, 7],
    }
    for fields in (
        {"machines": {"eye": looking}, "infeeds": {"in": feed}},
        {"machines": {"eye": looking, "in": {"kind": "source", **feed}}},
    ):
        sim = line(**fields, outfeeds={"out": {"region": END}})
        seen = []
        for _ in range(600):
            before = signals(sim)
            sim.advance()
            now = signals(sim)
            if now["machines/eye/bad"] > before["machines/eye/bad"]:
                seen.append(now["machines/eye/count"])
        assert seen == [2, 3, 7]


@pytest.mark.parametrize(
    ("machine", "says"),
    [
        (sink(2.0, rate_limit=1.0), "machines.it.rate_limit: 1 given, expected at least 2 (1/s), the rate"),
        (source(bad_share=0.1, bad_every=3), "both of bad_share and bad_every given, expected at most one of them"),
        (source(bad_share=1.1), "machines.it.bad_share: 1.1 given, expected a number from 0 to 1"),
        (source(bottle="can"), 'machines.it.bottle: "can" given, expected a name from bottle_types: bottle'),
        (sink(region=[[0, 0], [1, 1], [1, 0], [0, 1]]), "expected a simple polygon"),
        ({"kind": "inspection", "from": [0, 0], "to": [0, 0]}, "expected another point than from"),
        ({"kind": "press"}, 'expected "source", "sink", "station", "inspection" or "reject"'),
    ],
)
def test_what_is_refused_and_why(machine: dict[str, Any], says: str) -> None:
    with pytest.raises(SceneError) as refused:
        line(machines={"it": machine})
    assert says in str(refused.value)
