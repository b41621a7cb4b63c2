# SPDX-License-Identifier: Apache-2.0
"""Production of a recorded line: read from its bag, printed and drawn."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from bag.small_line import SMALL_LINE
from click.testing import CliRunner
from facts import missing, stating

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.bag.replay import replay
from conveyor_sim.cli import main
from conveyor_sim.errors import BagError
from conveyor_sim.line.commands.inputs import FORCE, Input
from conveyor_sim.line.machines.counters import RESET_COUNTERS
from conveyor_sim.line.machines.efficiency import CATEGORIES
from conveyor_sim.report.periods import longest_stops, stop_reasons
from conveyor_sim.report.production import Production, read_production
from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.simulation import Simulation

FAILING_LINE = Path(__file__).with_name("failing_line.yaml")
MACHINES = ("machines/filler", "machines/capper", "machines/packer")


def record(
    folder: Path,
    resets: tuple[int, ...] = (),
    ticks: int = 6000,
    start: Path | None = None,
    forced: str = "",
    scene: Scene | None = None,
) -> Path:
    """The failing line, with its counters reset at some ticks, and a signal forced to 1 from the start."""
    scene = scene or load_scene(FAILING_LINE)
    sim = Simulation(scene) if start is None else Simulation.load(start, scene=scene)
    with Recorder(folder) as recorder:
        outputs = OutputWriter(sim, [recorder], run_id="run")
        outputs.start()
        if forced:
            sim.give(Input("operate", "Jo", "engineer", FORCE, (forced,), (1.0,)))
        while sim.tick < ticks:
            if sim.tick in resets:
                sim.give(Input("commands", "shift", "operator", RESET_COUNTERS, (), ()))
            sim.advance()
            outputs.after_tick()
    return folder


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("production") / "bag")


@pytest.fixture(scope="module")
def production(bag: Path) -> Production:
    return read_production(bag)


def test_periods_are_where_the_counted_time_went(production: Production) -> None:
    """Periods of each machine are contiguous from start to end, and sum up to its counters."""
    assert tuple(production.periods) == MACHINES
    for index, (machine, periods) in enumerate(production.periods.items()):
        assert (periods[0].begin, periods[-1].end) == (production.start, production.end), machine
        assert (production.start, production.end) == pytest.approx((0.0, 60.0))
        assert all(one.end == other.begin for one, other in pairwise(periods))
        for category in CATEGORIES:
            length = sum(period.length for period in periods if period.category == category)
            assert length == pytest.approx(getattr(production.counters, category)[index], abs=1e-6), (machine, category)


def test_stops_have_their_reasons(production: Production) -> None:
    """The capper fails once, for 12 s, after 10 s of running; the filler has a break of 6 s; others wait for them."""
    reasons = {
        (entry.machine, entry.why): entry for entry in stop_reasons(p for m in production.periods.values() for p in m)
    }
    assert reasons["machines/capper", "failure cap_feeder"].stops == 1
    assert reasons["machines/capper", "failure cap_feeder"].length == pytest.approx(12.0)
    assert reasons["machines/filler", "planned stop break"].length == pytest.approx(6.0, abs=0.011)
    assert reasons["machines/filler", "blocked"].length > 3.0
    assert reasons["machines/packer", "starved"].length > 12.0
    capper = production.periods["machines/capper"]
    (failure,) = longest_stops(capper, 1)
    assert failure.why == "failure cap_feeder"
    before = [period for period in capper if period.category == "running" and period.end <= failure.begin]
    assert sum(period.length for period in before) == pytest.approx(10.0, abs=0.011)


def test_a_stop_commanded_during_a_failure_is_the_reason_after_the_repair(
    production: Production, tmp_path: Path
) -> None:
    """The signal keeps the failure as the reason. The capper is repaired, and started again 5 s later."""
    (failure,) = longest_stops(production.periods["machines/capper"], 1)
    stop, start = (round(100 * (failure.begin + wait)) for wait in (2.0, failure.length + 5.0))
    sim = Simulation(load_scene(FAILING_LINE))
    with Recorder(tmp_path / "bag") as recorder:
        outputs = OutputWriter(sim, [recorder], run_id="run")
        outputs.start()
        while sim.tick < start + 300:
            if sim.tick in (stop, start):
                sim.command(["machines/capper/run"], [float(sim.tick == start)], "plc")
            sim.advance()
            outputs.after_tick()
    stopped = {
        (period.category, period.why): period.length
        for period in read_production(tmp_path / "bag").periods["machines/capper"]
        if period.category in ("down", "idle")
    }
    assert stopped == {
        ("down", "failure cap_feeder"): pytest.approx(12.0),
        ("idle", "command run"): pytest.approx(5.0, abs=0.021),
    }


def test_a_repaired_machine_waits_for_its_neighbour(production: Production) -> None:
    """Time behind the repair is starved or blocked as soon as the machine waits again."""
    periods = production.periods["machines/capper"]
    (failure,) = longest_stops(periods, 1)
    assert {period.why for period in periods if period.begin >= failure.end} <= {"running", "starved", "blocked"}
    assert any(period.category == "starved" for period in periods if period.begin >= failure.end)


def test_bottles_of_the_report_are_those_of_the_counters(production: Production) -> None:
    counters = production.counters
    made = dict(zip(counters.name, zip(counters.processed, counters.defective, strict=True), strict=True))
    assert made["machines/capper"][1] == 2
    assert made["line"] == made["machines/packer"]
    assert production.good[-1] == counters.good[-1]
    assert np.all(np.diff(production.good) >= 0.0)
    assert list(counters.bottleneck) == ["machines/filler"]


def test_alarms_are_counted(bag: Path, tmp_path: Path) -> None:
    """A controller raises and clears alarms; one is active at the end."""
    scene = load_scene(FAILING_LINE)
    sim = Simulation(scene)
    with Recorder(tmp_path / "bag") as recorder:
        outputs = OutputWriter(sim, [recorder], run_id="run")
        outputs.start()
        for tick in range(500):
            if tick % 20 == 0 and tick < 480:
                sim.command(("alarms/table full",), (float(tick % 40 == 0),))
            if tick == 450:
                sim.command(("alarms/no caps",), (1.0,))
            sim.advance()
            outputs.after_tick()
    alarms = read_production(tmp_path / "bag").alarms
    assert alarms.by_alarm["table full"] == 12
    assert alarms.by_alarm["no caps"] == 1
    assert alarms.flood and alarms.most_in_window == alarms.raised
    assert [one.id for one in alarms.standing] == ["no caps"]
    result = CliRunner().invoke(
        main, ["report", str(tmp_path / "bag"), "--no-pictures", "--from", "0"], catch_exceptions=False
    )
    assert "a flood" in result.output and "no caps" in result.output


def test_the_report_prints_and_draws_it(bag: Path, tmp_path: Path) -> None:
    result = CliRunner().invoke(
        main,
        ["report", str(bag), "--out", str(tmp_path), "--from", "0"],
        env={"COLUMNS": "200"},
        catch_exceptions=False,
    )
    assert result.exit_code == 0
    rows = [line.split() for line in result.output.splitlines()]
    assert ["machines/capper", "failure", "cap_feeder", "1", "12.00"] in [row[:5] for row in rows]
    assert any(row[:1] == ["efficiency"] for row in rows)
    for word in ("OEE", "MTBF", "availability", "PBT"):
        assert word in result.output
    assert {path.name for path in tmp_path.iterdir()} == {
        f"{stem}.{suffix}" for stem in ("states", "stops", "efficiency") for suffix in ("png", "svg")
    }


def test_of_a_line_that_has_made_nothing_yet_it_says_so(tmp_path: Path) -> None:
    """Its packer, which waits for its first bottles, is idle for no reason; ten minutes are longer than the run."""
    scene = load_scene(FAILING_LINE, {"machines": {"packer": {"start_fill": 1}}})
    shown = CliRunner().invoke(main, ["report", str(record(tmp_path / "bag", ticks=200, scene=scene)), "--no-pictures"])
    rows = [line.split() for line in shown.output.splitlines()]
    assert ["machines/packer", "idle", "1", "2.00"] in [row[:4] for row in rows]
    assert ["OEE", "not", "known:"] in [row[:3] for row in rows]
    assert missing(shown.output, ["no bottle has left the line"]) == []
    assert ["alarms", "0"] in [row[:2] for row in rows]


def test_no_name_and_no_number_is_cut_on_a_terminal_of_80_columns(bag: Path) -> None:
    shown = CliRunner().invoke(main, ["report", str(bag), "--no-pictures"], env={"COLUMNS": "80"}).output
    assert "\N{HORIZONTAL ELLIPSIS}" not in shown
    for machine in MACHINES:  # bottles, time, efficiency, failures, reasons, longest stops
        assert len({line for line in shown.splitlines() if line.startswith(f"  {machine} ")}) >= 6
    assert any(line.startswith("  efficiency ") for line in shown.splitlines())


def test_forced_signals_are_named_and_change_no_figure(bag: Path, tmp_path: Path) -> None:
    """In the table and on every picture."""
    name = "machines/capper/blocked"
    forced = read_production(record(tmp_path / "bag", forced=name))
    assert tuple(forced.forced) == (name,) and tuple(read_production(bag).forced) == ()
    assert forced.periods == read_production(bag).periods
    shown = CliRunner().invoke(main, ["report", str(tmp_path / "bag"), "--out", str(tmp_path)], catch_exceptions=False)
    assert f"forced      {name}" in shown.output
    pictures = [path for path in tmp_path.iterdir() if path.suffix == ".svg"]
    assert len(pictures) == 3 and all("forced: " in path.read_text() for path in pictures)


def test_the_same_report_gives_the_same_pictures(bag: Path, tmp_path: Path) -> None:
    for name in ("one", "other"):
        CliRunner().invoke(main, ["report", str(bag), "--out", str(tmp_path / name)], catch_exceptions=False)
    for picture in (tmp_path / "one").iterdir():
        assert picture.read_bytes() == (tmp_path / "other" / picture.name).read_bytes()


def test_resets_are_replayed_and_lose_no_good_bottles(bag: Path, tmp_path: Path) -> None:
    """But those that leave between the last message before a reset and the reset: within a second."""
    again = record(tmp_path / "bag", resets=(2950, 4000))
    found, whole = read_production(again), read_production(bag)
    assert found.resets == 2
    assert found.counters.since.tolist() == [4000] * 4
    assert 0 <= whole.good[-1] - found.good[-1] <= 5
    assert [p for m in found.periods.values() for p in m] == [p for m in whole.periods.values() for p in m]
    report = replay(again)
    assert report.difference is None
    assert report.compared["counters"] == 61


def test_a_client_that_joins_late_sees_the_same(bag: Path, tmp_path: Path) -> None:
    """A recording that begins in the middle, at a checkpoint, ends with the counters of one from the start."""
    sim = Simulation(load_scene(FAILING_LINE))
    sim.advance(1550)
    sim.save(tmp_path / "half.checkpoint")
    late = read_production(record(tmp_path / "late", start=tmp_path / "half.checkpoint"))
    whole = read_production(bag)
    for field in vars(whole.counters):
        np.testing.assert_array_equal(
            np.asarray(getattr(late.counters, field)), np.asarray(getattr(whole.counters, field)), field
        )
    assert late.start == 16.0  # the first counters after 15.5 s
    for machine, periods in whole.periods.items():
        assert [p for p in periods if p.begin > 16.0] == [p for p in late.periods[machine] if p.begin > 16.0]


def test_a_recording_without_counters_is_refused_in_a_sentence(tmp_path: Path) -> None:
    sim = Simulation(load_scene(SMALL_LINE, {"outputs": {"counters": 0.0}}))
    with Recorder(tmp_path / "bag") as recorder:
        outputs = OutputWriter(sim, [recorder], run_id="run")
        outputs.start()
        for _ in range(10):
            sim.advance()
            outputs.after_tick()
    with pytest.raises(BagError, match=stating("topic counters", "no message")):
        read_production(tmp_path / "bag")
