# SPDX-License-Identifier: Apache-2.0
"""Counters of machines and of the line: sums, resets, late readers, checkpoints."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from facts import missing
from scenes import base, belt, contact, segment, simulation

from conveyor_sim.columns.counters import CounterColumns
from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.line.machines.counters import RESET_COUNTERS
from conveyor_sim.line.machines.efficiency import CATEGORIES
from conveyor_sim.simulation import Simulation

END = [[1.75, -0.2], [2.0, -0.2], [2.0, 0.2], [1.75, 0.2]]
FILLER, PACKER, LINE = "machines/filler", "machines/packer", "line"
JAM = {"jam": {"between": {"kind": "list", "times": [3.0]}, "repair": {"kind": "list", "times": [1.0, 2.0]}}}


def line(filler: dict[str, Any] | None = None, packer: dict[str, Any] | None = None, **fields: Any) -> Simulation:
    """Return a filler of two bottles per second, a belt of 2 m at 0.5 m/s, and a packer of 2.5 per second.

    Bottles move in single file.
    """
    source = {"kind": "source", "bottle": "bottle", "position": [0.0, 0.0], "direction": 0.0, "speed": 0.5, "rate": 2.0}
    sink = {"kind": "sink", "region": END, "rate": 2.5}
    given: dict[str, Any] = {
        "accuracy": {"per_tick": 50},
        "base": base(0.4),
        "contacts": [contact(5e4, damping=("normal", 30.0)), contact(5e4, "steel", damping=("normal", 30.0))],
        "belts": {"one": belt(0.5, (-0.2, -0.1), 2.2, 0.2)},
        "rails": {"end": segment((2.0, 0.1), (2.0, -0.1))},
        "machines": {"filler": source | (filler or {}), "packer": sink | (packer or {})},
    }
    return simulation(**{**given, **fields})


def reset(sim: Simulation, *names: str) -> None:
    sim.give(Input("commands", "shift", "operator", RESET_COUNTERS, names, ()))


def counters(sim: Simulation) -> CounterColumns:
    found = sim.line.counters()
    assert found is not None
    return found


def row(columns: CounterColumns, name: str) -> dict[str, Any]:
    index = columns.name.index(name)
    return {field: getattr(columns, field)[index] for field in vars(columns) if field != "bottleneck"}


def test_times_add_up_to_all_time_and_bottles_to_the_signals() -> None:
    """Over a run with failures, blocked and starved machines, looked at now and then."""
    sim = line(
        filler={"failures": JAM}, packer={"failures": JAM, "planned_stops": {"break": {"start": 20.0, "duration": 4.0}}}
    )
    for _ in range(20):
        sim.advance(201)
        now, signals = counters(sim), dict(zip(sim.process_image.signal_names, sim.signals().tolist(), strict=True))
        for name in (FILLER, PACKER, LINE):
            assert sum(row(now, name)[category] for category in CATEGORIES) == pytest.approx(sim.time, abs=1e-9)
        assert row(now, FILLER)["processed"] == signals[f"{FILLER}/produced"]
        assert row(now, FILLER)["blocked"] == signals[f"{FILLER}/blocked_time"]
        assert row(now, PACKER)["starved"] == signals[f"{PACKER}/starved_time"]
        assert row(now, PACKER)["processed"] == row(now, LINE)["processed"] == signals[f"{PACKER}/processed"]
        assert 0 <= signals[f"{PACKER}/taken"] - signals[f"{PACKER}/processed"] <= 1
        assert row(now, PACKER)["failures"] == signals[f"{PACKER}/failures"]
        assert now.category[1] == CATEGORIES[int(signals[f"{PACKER}/category"])]
    assert row(now, PACKER)["planned"] == pytest.approx(4.0, abs=0.02)
    assert all(row(now, PACKER)[category] > 0.0 for category in CATEGORIES if category not in ("idle", "blocked"))


def test_failures_give_mtbf_and_mttr() -> None:
    """Each run lasts 3 s; repairs take 1 s and 2 s in turn."""
    sim = line(filler={"failures": JAM})
    sim.advance(2 * (300 + 100) + 2 * (300 + 200) + 50)
    filler = row(counters(sim), FILLER)
    assert filler["failures"] == 4
    assert filler["mtbf"] == pytest.approx((4 * 3.0 + 0.5) / 4, abs=0.01)
    assert filler["mttr"] == pytest.approx(1.5, abs=0.02)
    assert filler["down"] == pytest.approx(6.0, abs=0.05)
    assert filler["availability"] == pytest.approx(filler["running"] / sim.time)


def test_a_filler_completes_the_cycles_of_its_rate() -> None:
    """The first bottle takes a cycle too: 60 in 30 s at two a second, and none in the first half second."""
    sim = line()
    sim.advance(49)
    assert row(counters(sim), FILLER)["processed"] == sim.counts.fed == 0
    sim.advance(2951)
    filler = row(counters(sim), FILLER)
    assert filler["processed"] == sim.counts.fed == 60
    assert (filler["effectiveness"], filler["oee"]) == (pytest.approx(1.0), pytest.approx(1.0))


def test_effectiveness_refers_to_the_fastest_permitted_rate() -> None:
    """The filler runs for 10 s at its nominal rate of 2 a second, then for 10 s at 1, of 4 that are permitted."""
    sim = line(filler={"rate_limit": 4.0})
    sim.advance(1000)
    sim.command([f"{FILLER}/rate"], [1.0])
    sim.advance(1000)
    filler = row(counters(sim), FILLER)
    assert (filler["rate"], filler["rate_limit"], filler["processed"]) == (2.0, 4.0, 30)
    assert filler["effectiveness"] == pytest.approx(30 / (4.0 * 20.0))
    assert filler["set_effectiveness"] == pytest.approx(1.0)
    sim.command([f"{FILLER}/rate"], [4.0])
    sim.advance(1000)
    filler = row(counters(sim), FILLER)
    assert filler["effectiveness"] == pytest.approx(filler["processed"] / (4.0 * filler["running"]))
    assert 0.95 < filler["set_effectiveness"] <= 1.0


def test_the_efficiency_of_a_line_is_that_of_its_bottleneck_with_its_own_quality() -> None:
    """The filler is the slower one; of the bottles that left, every fourth is bad. Those on their way are no loss."""
    sim = line(filler={"bad_every": 4})
    sim.advance(2000)
    now = counters(sim)
    assert now.bottleneck == (FILLER,)
    whole, packer = row(now, LINE), row(now, PACKER)
    assert whole["rate"] == 2.0
    assert whole["defective"] == packer["defective"] == packer["processed"] // 4
    assert whole["processed"] < row(now, FILLER)["processed"] == 40
    assert whole["oee"] == pytest.approx(whole["quality"]) == pytest.approx(whole["good"] / whole["processed"])
    assert packer["oee"] == pytest.approx(packer["good"] / (2.5 * 20.0))
    assert row(now, FILLER)["effectiveness"] == pytest.approx(1.0)


def test_parallel_packers_are_one_bottleneck_together() -> None:
    """Two packers of 0.8 bottles a second take less than the filler gives."""
    half = {"kind": "sink", "rate": 0.8}
    near, far = [[1.0, -0.1], [1.2, -0.1], [1.2, 0.1], [1.0, 0.1]], END
    machines = {"one": half | {"region": near}, "two": half | {"region": far}}
    source = {"kind": "source", "bottle": "bottle", "position": [0.0, 0.0], "direction": 0.0, "speed": 0.5, "rate": 2.0}
    sim = line(machines={"filler": source, **machines})
    sim.advance(1000)
    now = counters(sim)
    assert now.bottleneck == ("machines/one", "machines/two")
    assert row(now, LINE)["rate"] == 1.6
    one, two = row(now, "machines/one"), row(now, "machines/two")
    assert row(now, LINE)["starved"] == pytest.approx((one["starved"] + two["starved"]) / 2)
    cycles = one["processed"] + two["processed"]
    assert row(now, LINE)["effectiveness"] == pytest.approx(cycles / (0.8 * (one["running"] + two["running"])))


def test_a_reset_counts_anew_from_its_tick() -> None:
    """One machine is reset alone, then everything. A reset counter equals that of a line that starts then."""
    sim = line(packer={"failures": JAM})
    sim.advance(1000)
    before = counters(sim)
    reset(sim, PACKER)
    sim.advance(1)
    now = counters(sim)
    assert row(now, PACKER)["since"] == 1000
    assert sum(row(now, PACKER)[category] for category in CATEGORIES) == pytest.approx(0.01)
    assert row(now, PACKER)["processed"] <= 1
    assert row(now, LINE)["processed"] >= row(before, LINE)["processed"] > 1
    assert row(now, FILLER)["since"] == row(now, LINE)["since"] == 0
    reset(sim)
    sim.advance(100)
    now = counters(sim)
    assert now.since.tolist() == [1001] * 3
    for name in (FILLER, PACKER, LINE):
        assert sum(row(now, name)[category] for category in CATEGORIES) == pytest.approx(1.0)
    assert row(now, FILLER)["processed"] == 2
    accepted = [outcome for outcome in sim.take_outcomes() if outcome.operation == RESET_COUNTERS]
    assert [outcome.accepted for outcome in accepted] == [True, True]


def test_what_counts_nothing_can_t_be_reset() -> None:
    sim = line()
    for names, values in ((("machines/nobody",), ()), ((PACKER,), (1.0,))):
        sim.give(Input("commands", "shift", "operator", RESET_COUNTERS, names, values))
    sim.advance(1)
    first, second = sim.take_outcomes()
    assert first.reason == f"machines/nobody: counts nothing, expected {FILLER}, {PACKER}, line or none"
    assert missing(second.reason, "1 values", "reset_counters", "none") == []
    assert counters(sim).since.tolist() == [0, 0, 0]


def test_counters_do_not_depend_on_who_looks_and_go_on_from_a_checkpoint(tmp_path: Path) -> None:
    """A late client reads the same as one that has read at every tick."""
    watched, alone = (line(filler={"failures": JAM}, packer={"failures": JAM}) for _ in range(2))
    for sim in (watched, alone):
        reset(sim, FILLER)
    for _ in range(700):
        watched.advance()
        counters(watched)
    alone.advance(700)
    alone.save(tmp_path / "half.checkpoint")
    again = Simulation.load(tmp_path / "half.checkpoint")
    other = line(filler={"failures": JAM}, packer={"failures": JAM})
    other.restore_from(alone)
    for sim in (watched, alone, again, other):
        reset(sim, LINE)
        sim.advance(655)
    same(counters(watched), counters(alone))
    same(counters(watched), counters(again))
    same(counters(watched), counters(other))


def test_devices_without_times_have_counts_alone() -> None:
    """An inspection, an infeed, an outfeed; a line of nothing but belts has no counters."""
    looking = {"kind": "inspection", "from": [0.5, -0.1], "to": [0.5, 0.1]}
    feed = {"bottle": "bottle", "position": [0.0, 0.0], "direction": 0.0, "speed": 0.5, "rate": 2.0, "bad_every": 3}
    sim = line(machines={"eye": looking}, infeeds={"in": feed}, outfeeds={"out": {"region": END}})
    sim.advance(600)
    now = counters(sim)
    assert set(now.name) == {"infeeds/in", "outfeeds/out", "machines/eye", LINE}
    assert row(now, "machines/eye")["defective"] == row(now, "machines/eye")["processed"] // 3 > 0
    assert row(now, "infeeds/in")["good"] + row(now, "infeeds/in")["defective"] == row(now, "infeeds/in")["processed"]
    assert row(now, LINE)["good"] == row(now, LINE)["processed"] - row(now, LINE)["defective"]
    assert not now.bottleneck
    assert all(np.isnan(getattr(now, field)).all() for field in ("rate", "availability", "oee", "mtbf"))
    assert all((getattr(now, category) == 0.0).all() for category in CATEGORIES)
    assert line(machines={}).line.counters() is None


def test_what_is_thrown_out_is_rejected_and_has_not_left() -> None:
    thrower = {"kind": "reject", "region": [[0.9, -0.1], [1.1, -0.1], [1.1, 0.1], [0.9, 0.1]]}
    sim = line()
    machines = {
        "filler": sim.scene.machines["filler"].model_dump(),
        "packer": sim.scene.machines["packer"].model_dump(),
    }
    sim = line(machines={**machines, "thrower": thrower})
    for _ in range(5):
        sim.advance(100)
        sim.command(["machines/thrower/fire"], [1.0])
        sim.advance(100)
        sim.command(["machines/thrower/fire"], [0.0])
    now = counters(sim)
    assert row(now, "machines/thrower")["rejected"] == row(now, LINE)["rejected"] > 0
    assert row(now, LINE)["processed"] == row(now, PACKER)["processed"]


def same(one: CounterColumns, other: CounterColumns) -> None:
    for field in vars(one):
        np.testing.assert_array_equal(np.asarray(getattr(one, field)), np.asarray(getattr(other, field)), field)
