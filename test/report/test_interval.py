# SPDX-License-Identifier: Apache-2.0
"""Figures of a time span of a recording, against counters of the same run that were reset at its start."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from facts import missing, stating
from report.test_production import FAILING_LINE, MACHINES, record

from conveyor_sim.cli import main
from conveyor_sim.columns.counters import CounterColumns
from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.line.machines.counters import RESET_COUNTERS
from conveyor_sim.report.production import read_production
from conveyor_sim.report.span import PARTS, Times, span_of
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

TICKS = 3000


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    scene = load_scene(FAILING_LINE, {"outputs": {"signals": 100.0}})
    return record(tmp_path_factory.mktemp("interval") / "bag", ticks=TICKS, scene=scene)


def counted(start: int, stop: int, overrides: Mapping[str, Any] | None = None) -> CounterColumns:
    """Return the counters of the same run at `stop`, reset at `start` (ticks)."""
    sim = Simulation(load_scene(FAILING_LINE, overrides))
    sim.advance(start)
    sim.give(Input("commands", "shift", "operator", RESET_COUNTERS, (), ()))
    sim.advance(stop - start)
    columns = sim.line.counters()
    assert columns is not None
    return columns


@pytest.mark.parametrize(("start", "stop"), [(0, TICKS), (417, 2203), (800, 823), (1234, 2999)])
def test_a_span_has_the_figures_of_counters_reset_at_its_start(bag: Path, start: int, stop: int) -> None:
    """To the tick: bottles, times and ratios of machines and of the line, resets within cycles included."""
    within, expected = read_production(bag, Times(start * 0.01, stop * 0.01)).counters, counted(start, stop)
    assert tuple(within.name) == tuple(expected.name)
    for field in vars(expected):
        if field in ("name", "since", "category", "stop_reason", "bottleneck"):
            continue
        values, others = getattr(within, field), getattr(expected, field)
        if field in ("effectiveness", "set_effectiveness", "oee"):  # of the first cycle, up to two ticks are unknown
            assert (~(values > others + 1e-9)).all(), field
            missed = 0.02 / expected.running if start else 1e-9
            assert (~(values < others - missed)).all(), field
        else:
            np.testing.assert_allclose(values, others, atol=1e-9, rtol=1e-9, err_msg=field)


def test_a_span_that_begins_within_a_case_counts_the_part_of_it(tmp_path: Path) -> None:
    """A packer takes three bottles at once."""
    region = [[2.15, -0.05], [2.4, -0.05], [2.4, 0.05], [2.15, 0.05]]
    cases: dict[str, Any] = {"machines": {"packer": {"at_once": 3, "region": region}}}
    scene = load_scene(FAILING_LINE, {**cases, "outputs": {"signals": 100.0}})
    bag = record(tmp_path / "bag", ticks=TICKS, scene=scene)
    row, parts = MACHINES.index("machines/packer"), set()
    for start in range(600, 1000, 57):
        within, expected = read_production(bag, Times(start * 0.01, 12.5)).counters, counted(start, 1250, cases)
        assert within.processed[row] == expected.processed[row] > 0
        assert within.running[row] == pytest.approx(expected.running[row])
        missed = 0.02 / expected.running[row]
        assert -1e-9 <= expected.effectiveness[row] - within.effectiveness[row] <= missed
        parts.add(round(within.effectiveness[row], 2))
    assert len(parts) > 1


def test_spans_add_up_and_lose_no_bottle(bag: Path) -> None:
    ends = [0, 311, 1100, 1101, 2750, TICKS]
    parts = [read_production(bag, Times(a * 0.01, b * 0.01)).counters for a, b in pairwise(ends)]
    whole = read_production(bag, Times(0.0, TICKS * 0.01)).counters
    for field in ("processed", "good", "failures", "running", "starved", "blocked", "down"):
        total = sum(getattr(part, field) for part in parts)
        np.testing.assert_allclose(total, getattr(whole, field), atol=1e-9, err_msg=field)


def test_the_warm_up_is_left_out_and_named(bag: Path) -> None:
    """At least until the first bottle leaves, which fills a line without loss."""
    production = read_production(bag, Times())
    whole = read_production(bag, Times(0.0))
    assert whole.start == 0.0 < production.start < production.end == whole.end
    assert missing(production.remark, "warm-up", f"{production.start:g} s", "left out") == []
    printed = CliRunner().invoke(main, ["report", str(bag), "--no-pictures"], env={"COLUMNS": "200"}).output
    assert f"{production.start:.2f} s to {production.end:.2f} s" in printed and "warm-up" in printed
    printed = CliRunner().invoke(main, ["report", str(bag), "--no-pictures", "--from", "2", "--to", "12.5"]).output
    assert "2.00 s to 12.50 s" in printed and "warm-up" not in printed


def test_a_line_that_no_bottle_leaves_is_reported_from_the_start() -> None:
    span = span_of(Times(), 0, 1000, [], 0.01)
    assert (span.start, span.stop) == (0, 1000)
    assert missing(span.remark, "no bottle left", "warm-up included") == []


def test_the_warm_up_ends_where_the_throughput_has_settled() -> None:
    """Bottles leave every 50 ticks from tick 3000 on, and every 200 before; the first at tick 1000."""
    left = [*range(1000, 3000, 200), *range(3000, 40000, 50)]
    span = span_of(Times(), 0, 40000, left, 0.01)
    assert 2800 <= span.start <= 4000 and "MSER-5" in span.remark
    draw = np.random.default_rng(2)
    for _ in range(20):  # settled from the first bottle on, with gaps that differ
        settled = span_of(Times(), 0, 40000, [*np.cumsum([1000, *draw.integers(20, 300, 200)])], 0.01)
        assert settled.start == 1000 and "first bottle" in settled.remark
    few = span_of(Times(), 0, PARTS - 1, [20, 70], 0.01)
    assert few.start == 20 and "not have settled" in few.remark


@pytest.mark.parametrize(
    ("times", "facts"),
    [
        (Times(-1.0), ("--from", "-1 s", "0 to 30 s")),
        (Times(float("nan")), ("--from", "nan s", "0 to 30 s")),
        (Times(0.0, float("inf")), ("--to", "inf s", "0 to 30 s")),
        (Times(1e300), ("--from", "1e+300 s", "0 to 30 s")),
        (Times(20.0, 10.0), ("--from", "--to", "20 s", "10 s")),
        (Times(10.0, 10.0), ("--from", "--to", "10 s")),
    ],
)
def test_times_outside_the_recording_are_refused(bag: Path, times: Times, facts: tuple[str, ...]) -> None:
    with pytest.raises(ConveyorError, match=stating(*facts)):
        read_production(bag, times)
