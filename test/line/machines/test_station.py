# SPDX-License-Identifier: Apache-2.0
"""Stations: the same bottle with its loads after a cycle; settings and tests, also wrong tests."""

import json
import math
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from line.machines.machine_line import END, line, signals, sink, source, station
from scenes import belt, contact, segment

from conveyor_sim.errors import CheckpointError
from conveyor_sim.physics.state.checkpoint import read_checkpoint
from conveyor_sim.simulation import Simulation

BEFORE = [[0.85, -0.2], [1.0, -0.2], [1.0, 0.2], [0.85, 0.2]]
BEHIND = [1.1, 0.0]
RAILS = {"end": segment((2.0, 0.1), (2.0, -0.1)), "stop": segment((1.0, 0.1), (1.0, -0.1))}

LOADED: dict[str, Any] = {
    "contacts": [contact(5e4, other, damping=("normal", 30.0), friction=0.2) for other in ("glass", "steel")],
    "outputs": {"damage": 10.0, "bottles": 100.0, "ledger": 1.0},
    "limits": {"scuffing_work": 1e-6},
}
"""With friction, and with accounts of what bottles bear and of energy."""


def stationed(supply: float = 2.0, machines: dict[str, Any] | None = None, **given: Any) -> Simulation:
    """Return a filler, a station in the middle of the belt before a rail across it, and a packer."""
    more = {
        name: given.pop(name)
        for name in (
            "accuracy", "belts", "bottle_types", "contacts", "limits", "outputs", "panel", "rails", "seed",
        )
        if name in given
    }  # fmt: skip
    found = {"filler": source(supply), "capper": station(BEFORE, BEHIND, **given), "packer": sink(4.0)}
    return line(machines={**found, **(machines or {})}, duration=200.0, **{"rails": RAILS, **more})


def of(sim: Simulation, what: str, machine: str = "capper") -> float:
    return signals(sim)[f"machines/{machine}/{what}"]


def test_a_bottle_comes_back_after_a_cycle_with_its_id() -> None:
    """Single bottles, far apart, are each away for 1 / rate, without an event of removal or feeding."""
    sim = stationed(0.2, rate=2.0)
    gone: dict[int, int] = {}
    back: dict[int, int] = {}
    for _ in range(1500):
        before = set(sim.bottles().id.tolist())
        sim.advance()
        now = set(sim.bottles().id.tolist())
        told = {
            kind: {e.bottle for e in sim.line.happened if e.kind == kind} for kind in ("bottle_fed", "bottle_removed")
        }
        gone |= dict.fromkeys(before - now - told["bottle_removed"], sim.tick)
        back |= dict.fromkeys(now - before - told["bottle_fed"], sim.tick)
    assert len(back) >= 2
    assert {bottle: back[bottle] - gone[bottle] for bottle in back} == dict.fromkeys(back, 50)
    assert sim.counts.removed == of(sim, "taken", "packer")
    assert sim.counts.fed == of(sim, "produced", "filler")


def _held(sim: Simulation) -> set[int]:
    return set(sim._state.held)


def test_no_bottle_is_lost_between_the_line_and_a_station() -> None:
    sim = stationed(4.0, rate=2.0)
    for _ in range(1500):
        sim.advance()
        counts = sim.counts
        assert counts.fed == counts.removed + counts.present + counts.held
        assert counts.held == of(sim, "holds")
    assert of(sim, "processed") > 20


def test_in_the_long_run_it_works_at_its_rate() -> None:
    """The period of 1/3 s is no whole number of ticks. While bottles wait, the mean rate is still exact."""
    sim = stationed(4.0, rate=3.0)
    sim.advance(800)
    before = of(sim, "processed")
    sim.advance(1000)
    assert of(sim, "processed") - before == 30


def test_it_keeps_the_order() -> None:
    sim = stationed(4.0, rate=2.0)
    sim.advance(1200)
    bottles = sim.bottles()
    assert (np.diff(bottles.x) < 0).all(), "the older the farther along"


def test_starved_blocked_and_how_long() -> None:
    sim = stationed(0.5, rate=4.0, suspend_after=0.5, machines={"packer": sink(4.0, region=END)})
    sim.advance(150)
    assert (of(sim, "starved"), of(sim, "state")) == (1.0, 5.0)
    assert of(sim, "starved_time") == pytest.approx(1.49)
    sim = stationed(4.0, rate=3.0, suspend_after=0.5)
    sim.inject("machines/packer/stop", 1.0)
    sim.advance(3000)
    assert (of(sim, "blocked"), of(sim, "state"), of(sim, "holds")) == (1.0, 5.0, 1.0)
    before = of(sim, "blocked_time"), of(sim, "processed")
    sim.advance(100)
    assert (of(sim, "blocked_time"), of(sim, "processed")) == (pytest.approx(before[0] + 1.0), before[1])
    sim.inject("machines/packer/stop", 0.0)
    sim.advance(1000)
    assert of(sim, "processed") - before[1] == pytest.approx(30, abs=4)


def test_a_station_that_has_failed_keeps_its_bottle() -> None:
    sim = stationed(4.0, rate=2.0)
    sim.advance(500)
    while not of(sim, "holds"):
        sim.advance()
    (bottle,) = _held(sim)
    sim.inject("machines/capper/stop", 1.0)
    sim.advance(300)
    assert _held(sim) == {bottle}
    sim.inject("machines/capper/stop", 0.0)
    sim.advance(51)
    assert bottle in sim.bottles().id


def test_what_it_has_borne_stays_with_a_bottle() -> None:
    """Sliding work never decreases, although the bottle changes its slot. A passed limit is reported once."""
    # The belt presses them to one side, where they rub along a rail.
    belts = {"one": belt(0.5, (-0.2, -0.1), 2.3, 0.25, angle=-0.1)}
    rails = {**RAILS, "side": segment((2.0, -0.066), (-0.2, -0.066))}
    sim = stationed(4.0, rate=2.0, belts=belts, rails=rails, **LOADED)
    work: dict[int, float] = {}
    returned = 0
    before: set[int] = set()
    for _ in range(1500):
        sim.advance()
        damage = sim.damage()
        assert damage is not None
        for bottle, value in zip(damage.id.tolist(), damage.scuffing_work.tolist(), strict=True):
            assert value >= work.get(bottle, 0.0)
            returned += bottle in work and bottle not in before and value > 0.0
            work[bottle] = value
        before = set(damage.id.tolist())
    assert returned > 2
    passed = [event.bottle for event in sim.take_events().damage if event.kind == "scuffing_work"]
    assert passed
    assert len(passed) == len(set(passed))


def test_the_ledger_closes_over_what_is_taken_and_given() -> None:
    """Kinetic energy is booked with each bottle. The ledger of the same line with a sink closes as well."""
    share = []
    for machines in ({}, {"capper": sink(2.0, region=BEFORE)}):
        sim = stationed(4.0, rate=2.0, machines=machines, **LOADED)
        sim.advance(1500)
        ledger = sim.ledger()
        assert ledger is not None
        share.append(abs(ledger.residual) / ledger.turnover)
        assert ledger.fed > 0.0
    assert share[0] < 2.0 * share[1] + 1e-6


def test_settings_and_tests() -> None:
    """Some caps are missing, fill levels vary, one label is crooked; bottles that fail a test become bad."""
    sets = {
        "cap": {"to": 1.0, "share": 0.7},
        "fill_level": {"to": 0.5, "deviation": 0.01},
        "crooked": {"to": 1.0, "at": [3]},
    }
    tests = {"cap": {"low": 1.0}, "fill_level": {"low": 0.485, "high": 0.515}, "crooked": {"high": 0.0}}
    looking = {"kind": "inspection", "from": [1.5, -0.1], "to": [1.5, 0.1]}
    sim = stationed(4.0, rate=4.0, sets=sets, tests=tests, machines={"eye": looking}, seed=4)
    sim.advance(6000)
    processed = of(sim, "processed")
    assert processed > 200
    for name, share in (("cap", 0.3), ("fill_level", math.erfc(1.5 / math.sqrt(2.0)))):
        spread = math.sqrt(share * (1.0 - share) / processed)
        assert of(sim, f"defect_{name}") / processed == pytest.approx(share, abs=4.0 * spread)
    assert of(sim, "defect_crooked") == 1
    assert of(sim, "good") + of(sim, "defective") == processed
    assert (of(sim, "false_accepts"), of(sim, "false_rejects")) == (0, 0)
    most = sum(of(sim, f"defect_{name}") for name in tests)
    assert of(sim, "defective") < most, "some have two"
    assert of(sim, "bad", "eye") / of(sim, "count", "eye") == pytest.approx(of(sim, "defective") / processed, abs=0.05)


def test_tests_that_are_wrong_at_times() -> None:
    """Nine in ten bottles have no cap: a fifth of these pass, and a quarter of those with a cap fail."""
    test = {"cap": {"low": 1.0, "false_accept": 0.2, "false_reject": 0.25}}
    sim = stationed(4.0, rate=4.0, sets={"cap": {"to": 1.0, "share": 0.4}}, tests=test, seed=4)
    sim.advance(6000)
    processed = of(sim, "processed")
    for name, share in (("false_accepts", 0.6 * 0.2), ("false_rejects", 0.4 * 0.25)):
        spread = math.sqrt(share * (1.0 - share) / processed)
        assert of(sim, name) / processed == pytest.approx(share, abs=4.0 * spread)


def test_another_station_sees_what_the_first_has_made() -> None:
    """Every second cap is missing. The checker detects these; the mender sets them, and the bottles are good again."""
    check = {"cap": {"low": 1.0}}
    checker = station([[1.3, -0.2], [1.4, -0.2], [1.4, 0.2], [1.3, 0.2]], [1.5, 0.0], 4.0, tests=check,
                      sets={"bad": {"to": 0.0}})  # fmt: skip
    rails = {**RAILS, "second": segment((1.4, 0.1), (1.4, -0.1))}
    sim = stationed(3.0, rate=4.0, sets={"cap": {"to": 1.0, "every": 2}, "bad": {"to": 1.0}},
                    machines={"checker": checker}, rails=rails)  # fmt: skip
    sim.advance(3000)
    processed = of(sim, "processed", "checker")
    assert processed > 50
    assert of(sim, "defective", "checker") == (processed + 1) // 2
    assert of(sim, "taken_bad", "packer") == (of(sim, "taken", "packer") + 1) // 2


def test_what_is_gone_is_forgotten() -> None:
    """Memory is bounded by the bottles on the line, also in a shift of eight hours."""
    sim = stationed(4.0, rate=3.0, sets={"cap": {"to": 1.0}, "bad": {"to": 1.0}})
    sim.advance(2500)
    there = {*sim.bottles().id.tolist(), *_held(sim)}
    now = sim._line.now
    assert of(sim, "taken", "packer") > 20
    assert set(now.attributes["cap"]) <= there
    assert now.bad <= there


def test_two_variants_of_a_line_draw_the_same_caps() -> None:
    sets = {"cap": {"to": 1.0, "share": 0.5}}
    runs = []
    for more in ({}, {"label": {"to": 1.0, "share": 0.5}}):
        sim = stationed(4.0, rate=4.0, sets={**more, **sets}, tests={"cap": {"low": 1.0}}, seed=8)
        sim.advance(2000)
        runs.append((of(sim, "defective"), sorted(sim._line.now.attributes["cap"])))
    assert runs[0] == runs[1]


JAM = {"between": {"kind": "exponential", "mean": 3.0}, "repair": {"kind": "weibull", "mean": 1.0, "shape": 2.0}}


def test_a_run_goes_on_from_a_checkpoint_with_the_same_bits(tmp_path: Path) -> None:
    """The station holds a bottle or none; loads, attributes and draws are included."""
    sim = stationed(
        4.0, rate=2.3, ramp_up=0.4, failures={"jam": JAM}, sets={"cap": {"to": 1.0, "share": 0.6, }},
        tests={"cap": {"low": 1.0, "false_accept": 0.3}}, **LOADED,
    )  # fmt: skip
    held = set()
    for ticks in (50, 700, 37, 29, 61):
        sim.advance(ticks)
        held.add(sim.counts.held)
        sim.save(tmp_path / "there")
        loaded = Simulation.load(tmp_path / "there")
        for each in (sim, loaded):
            each.advance(100)
        assert loaded.full_state_hash() == sim.full_state_hash()
        assert loaded.signals().tolist() == sim.signals().tolist()
        assert loaded.counts == sim.counts
        assert _bytes(loaded.ledger()) == _bytes(sim.ledger())
        assert _bytes(loaded.damage()) == _bytes(sim.damage())
    assert held == {0, 1}


def _bytes(columns: Any) -> list[bytes]:
    return [np.asarray(getattr(columns, field.name)).tobytes() for field in fields(columns)]


@pytest.mark.parametrize(
    "changes",
    [
        {"held": []},
        {"held": "twice"},
        {"held": "on the line"},
        {"held": "of the future"},
        {"held": "of another type"},
        {"held": "without loads"},
    ],
    ids=lambda changes: str(changes["held"]),
)
def test_a_checkpoint_with_bottles_that_can_not_be_held_is_refused(changes: dict[str, Any], tmp_path: Path) -> None:
    sim = stationed(4.0, rate=2.0, **LOADED)
    while not sim.counts.held:
        sim.advance()
    memory = json.loads(json.dumps(sim._snapshot()))
    ((bottle, (kind, theta, loads)),) = memory["held"]
    there, entry = int(sim.bottles().id[0]), [bottle, [kind, theta, loads]]
    memory["held"] = {
        "[]": [],
        "twice": [entry, entry],
        "on the line": [[there, entry[1]]],
        "of the future": [[10_000, entry[1]]],
        "of another type": [[bottle, [7, theta, loads]]],
        "without loads": [[bottle, [kind, theta, []]]],
    }[str(changes["held"])]
    sim.save(tmp_path / "there")
    other = Simulation.load(tmp_path / "there")
    checkpoint = read_checkpoint(tmp_path / "there", None, None)
    checkpoint.memory.update(memory)
    with pytest.raises(CheckpointError, match="held has "):
        other._restore(checkpoint)
