# SPDX-License-Identifier: Apache-2.0
"""Impulses in a study: recommended for counts and throughput where they agree, refused for forces, skipped by law."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from accuracy.studies import study
from facts import missing

from conveyor_sim.accuracy.candidates import candidates, forbidden
from conveyor_sim.accuracy.measure.equivalence import decide, run_until_decided
from conveyor_sim.accuracy.report.apply import line
from conveyor_sim.accuracy.report.files import read_study, write_study
from conveyor_sim.accuracy.report.flow import find_flow
from conveyor_sim.accuracy.report.lines import recommended, summary
from conveyor_sim.accuracy.report.tables import blocks
from conveyor_sim.accuracy.results import Cost, Errors, FlowAnswer, Point, Sample
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.physics.timestep.prediction import DEEP
from conveyor_sim.scene import load_scene, parse_scene
from conveyor_sim.statistics.intervals import paired_ratio_interval, ratio_interval
from conveyor_sim.support.resources import scene_path

REFERENCE = Setting("leapfrog", 1000)
FAST, SLOW = Setting("impulses", 8, sweeps=2), Setting("impulses", 16, sweeps=2)
SEEDS = 8


def point(setting: Setting, cost: float, resting: float | None = 0.18, failure: str = "") -> Point:
    errors = Errors(1e-5, 1e-4, 0.0, 0.0, 0.0)
    return Point(setting, 0.01 / setting.per_tick, None, errors, Cost(cost, cost, cost), failure, 0.25, resting)


def runs(setting: Setting, throughput: float, overlap: float = 0.1, stop: float = 50.0) -> list[Sample]:
    """Return runs whose seeds differ by far more than the settings do."""
    return [
        Sample(setting, seed, {"throughput": throughput * (1.0 + 0.2 * seed), "stop force": stop,
                               "largest overlap": overlap, "mean queue force": 3.0 + seed}, 1.0, "")
        for seed in range(SEEDS)
    ]  # fmt: skip


def judged(fast: list[Sample], slow: list[Sample], points: list[Point] | None = None) -> FlowAnswer:
    samples = [*runs(REFERENCE, 60.0), *fast, *slow]
    comparisons = decide(samples, [FAST, SLOW], REFERENCE, 0.01, flow=True)
    assert {row.observable for row in comparisons} <= {"throughput"}
    found = find_flow(points or [point(SLOW, 0.04), point(FAST, 0.02)], samples, comparisons, REFERENCE, 0.01)
    assert found is not None
    return found


def test_the_cheapest_with_the_same_counts_is_recommended() -> None:
    flow = judged(runs(FAST, 60.1, stop=51.0), runs(SLOW, 60.0))
    assert flow.setting == FAST
    assert [row.setting for row in flow.rows] == [FAST, SLOW]
    first = flow.rows[0]
    assert (first.verdict, first.cost, first.overlap) == ("equivalent", 0.02, pytest.approx(0.001))
    assert first.stop_force == pytest.approx(0.02) and first.single_forces == 0.18 and first.measured
    assert missing(flow.sentence, ["impulses 8 x 2", "recommended", "counts and throughput", "1 %", "50 x"]) == []


def test_another_throughput_is_refused_and_the_next_is_taken() -> None:
    flow = judged(runs(FAST, 66.0), runs(SLOW, 60.0))
    assert flow.setting == SLOW
    assert flow.rows[0].verdict == "different" and "throughput" in flow.rows[0].reason
    neither = judged(runs(FAST, 66.0), runs(SLOW, 65.0))
    assert neither.setting is None
    assert missing(neither.sentence, ["not recommended", "throughput differs"]) == []


def test_overlaps_that_stiff_contacts_do_not_have_are_refused() -> None:
    flow = judged(runs(FAST, 60.0, overlap=101.0 * DEEP), runs(SLOW, 60.0, overlap=99.0 * DEEP))
    assert [row.verdict for row in flow.rows] == ["too deep", "equivalent"]
    assert flow.setting == SLOW


def test_forces_refuse_it_in_one_sentence() -> None:
    flow = judged(runs(FAST, 60.0), runs(SLOW, 60.0))
    assert missing(flow.refusal, ["impulses 8 x 2", "refused for forces", "single forces in a crowd", "18 %"]) == []
    assert flow.refusal.count(". ") == 0 and flow.refusal.endswith(".")
    unknown = judged(runs(FAST, 60.0), runs(SLOW, 60.0), [point(FAST, 0.02, None), point(SLOW, 0.04, None)])
    assert "25 % error in resting load, predicted" in unknown.refusal


def test_runs_that_fail_and_settings_without_runs_are_named() -> None:
    failed = [replace(one, values={}, failure="tunnelling: bottle 3") for one in runs(FAST, 60.0)]
    flow = judged(failed, [])
    assert [row.verdict for row in flow.rows] == ["failed", "not run"]
    assert flow.rows[0].reason == "tunnelling: bottle 3" and flow.setting is None
    assert find_flow([point(REFERENCE, 0.5)], [], [], REFERENCE, 0.01) is None


def test_what_was_asked_decides_the_setting(tmp_path: Path) -> None:
    flow = judged(runs(FAST, 60.0), runs(SLOW, 60.0))
    made = replace(study(), flow=flow)
    assert made.answer is not None
    assert recommended(made, "forces") == made.answer.setting
    assert recommended(made, "flow") == FAST
    forces, fast = summary(made), summary(made, "flow")
    assert any(text.startswith(f"Setting: {line(FAST)}") for text in fast)
    assert not any(text.startswith(f"Setting: {line(FAST)}") for text in forces)
    assert any("refused for forces" in text and "--for flow" in text for text in forces)
    # Without an equivalent setting, the setting for forces does for flow too.
    undecided = replace(made, flow=replace(flow, setting=None))
    assert recommended(undecided, "flow") == made.answer.setting
    write_study(made, tmp_path)
    assert read_study(tmp_path / "study.json") == made
    assert (tmp_path / "flow.csv").read_text().splitlines()[1].startswith("impulses,8,1.0,,2,0.02")
    (table,) = [block for block in blocks(made) if block.title.startswith("Impulses")]
    assert "equivalent" in table.markdown() and "8 x 2" in table.markdown()


def test_pairs_of_runs_resolve_what_seeds_hide() -> None:
    """Fieller's interval with the covariance, against the definition: |t| of values - r base at its ends."""
    random = np.random.default_rng(5)
    base = random.uniform(50.0, 80.0, 12)
    values = 1.02 * base + random.normal(0.0, 0.3, 12)
    interval, apart = paired_ratio_interval(values, base), ratio_interval(values, base)
    assert interval is not None and apart is not None
    for end in interval:
        left = values - end * base
        assert abs(left.mean()) / (left.std(ddof=1) / np.sqrt(12)) == pytest.approx(2.201, abs=1e-3)
    assert interval[0] < 1.02 < interval[1]
    assert interval[1] - interval[0] < 0.1 * (apart[1] - apart[0])
    assert paired_ratio_interval(base, base) == (1.0, 1.0)
    assert paired_ratio_interval(values[1:], base) is None


def test_scenes_that_impulses_refuse_skip_them_with_the_reason() -> None:
    scene = load_scene(scene_path("config/paper_plant.yaml"))
    assert not any(setting.sweeps for setting in candidates(scene))
    assert missing(forbidden(scene)["impulses"], ['"paper"', '"normal"', "integrator impulses"]) == []
    skipped = replace(study(), flow=None, skipped=(f"impulses: {forbidden(scene)['impulses']}",))
    assert any("not examined" in text and "damping" in text for text in summary(skipped, "flow"))


LINE = """\
name: one_by_one
duration: 5
tick: 0.01
accuracy: {integrator: leapfrog}
bottle_types: {b: {radius: 0.03, mass: 0.2, material: glass}}
contacts:
  - {between: [glass, glass], stiffness: 20000, damping: {law: normal, restitution: 0.5}}
  - {between: [glass, steel], stiffness: 20000, damping: {law: normal, restitution: 0.5}}
base: [{between: [glass, chain], friction: 0.3}]
belts: {line: {kind: straight, start: [0, -0.1], angle: 0, length: 1.2, width: 0.2, speed: 0.5, material: chain}}
rails:
  guide: {kind: segment, from: [0.3, 0.05], to: [0.6, 0.015], material: steel}
infeeds: {inlet: {bottle: b, position: [0.05, 0], direction: 0, speed: 0.5, rate: 4}}
outfeeds: {end: {region: [[0.9, -0.1], [1.2, -0.1], [1.2, 0.1], [0.9, 0.1]]}}
"""


def test_bottles_one_by_one_are_counted_alike_by_impulses(tmp_path: Path) -> None:
    """Real long runs: bottles that glance off a guide leave at the same rate as with leapfrog, seed by seed."""
    scene, fast, exact = parse_scene(LINE), Setting("impulses", 8, sweeps=2), Setting("leapfrog", 200)
    samples, comparisons = run_until_decided(
        scene, [fast], exact, 0.05, 20.0, tmp_path, lambda done, of, spent: None, 1, flow=True
    )
    flow = find_flow([point(fast, 0.02, None)], samples, comparisons, exact, 0.05)
    assert flow is not None and flow.setting == fast, flow
    (row,) = flow.rows
    assert row.throughput is not None and -0.05 < row.throughput.low <= row.throughput.high < 0.05
    assert row.throughput.reference > 200.0
    assert row.overlap is not None and row.overlap < DEEP
    assert row.stop_force is not None and abs(row.stop_force) < 0.5
