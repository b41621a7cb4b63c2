# SPDX-License-Identifier: Apache-2.0
"""Studies with one long run a point: what batch means say of it, in the row, the table and in words."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from facts import missing
from rich.console import Console
from studies.small import Here, setup_of

from conveyor_sim.simulation import Simulation
from conveyor_sim.statistics.batch_means import batch_means
from conveyor_sim.studies.effects import main_effects
from conveyor_sim.studies.line_of import scene_of
from conveyor_sim.studies.results import Results, read_results, write_parquet
from conveyor_sim.studies.runs import Runs
from conveyor_sim.studies.setup import Setup
from conveyor_sim.studies.sweep import sweep
from conveyor_sim.studies.table import points_table
from conveyor_sim.studies.verdict import verdicts

METRICS = ["throughput", {"queue": "mean belts/conveyor/bottles"}, "stops", {"made": "mean machines/first/produced"}]
TAG = "belts/conveyor/bottles"


@pytest.fixture(scope="module")
def single(tmp_path_factory: pytest.TempPathFactory) -> tuple[Setup, Results]:
    """40 s, of which 4 are left out, with one seed."""
    folder = tmp_path_factory.mktemp("single")
    setup = setup_of(folder, metrics=METRICS, seeds=1, duration=40.0, warm_up=4.0, overrides={"tick": 0.02})
    with Runs(setup, folder / "out", Here()) as runs:
        sweep(runs, setup)
    return setup, read_results(folder / "out")


def test_the_interval_is_that_of_batch_means_of_the_same_series(single: tuple[Setup, Results]) -> None:
    """The series taken by hand from the line, tick by tick; bottles counted second by second at its sink."""
    setup, results = single
    row = results.rows[1]
    simulation = Simulation(scene_of(setup, row.parameters, row.seed), threads=1)
    names = simulation.process_image.signal_names
    tag = names.index(TAG)
    (processed,) = (index for index, name in enumerate(names) if name.endswith("/processed"))  # of the sink
    queue, taken = [], []
    for tick in range(1, 2001):
        simulation.advance(1)
        simulation.take_outcomes()
        if tick > 200:
            queue.append(float(simulation.signals()[tag]))
        if tick >= 200 and tick % 50 == 0:
            taken.append(float(simulation.signals()[processed]))
    assert row.metrics["queue"] == pytest.approx(np.mean(queue))
    assert row.metrics["throughput"] == pytest.approx(60.0 * np.mean(np.diff(taken)))
    of_queue, of_taken = batch_means(queue), batch_means(60.0 * np.diff(taken))
    assert of_queue is not None and of_taken is not None
    assert row.half_widths["queue"] == pytest.approx(of_queue.interval.half_width)
    assert row.half_widths["throughput"] == pytest.approx(of_taken.interval.half_width)


def test_it_is_in_the_table_the_picture_and_the_file(single: tuple[Setup, Results], tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    _, results = single
    console = Console(width=200)
    with console.capture() as shown:
        console.print(points_table(results.rows, results.units, results.parameters))
    first = shown.get().splitlines()[1].split()
    half = results.rows[0].half_widths["throughput"]
    assert half is not None and first[3] == "±" and float(first[4]) == pytest.approx(half, rel=0.05)
    ((of_throughput,), _, (of_stops,), _) = [panels[0] for panels in main_effects(results)]
    assert of_throughput.half_width.tolist() == [row.half_widths["throughput"] for row in results.rows]
    assert np.isnan(of_stops.half_width).all(), "the number of stops is no mean over time"
    path = write_parquet(results, tmp_path / "results.parquet")
    assert read_results(path).rows == results.rows
    table = pandas.read_parquet(path)
    assert table["queue_half_width"].tolist() == [row.half_widths["queue"] for row in results.rows]
    assert table["made_half_width"].isna().all() and "stops_half_width" not in table


def test_what_batch_means_can_not_say_is_said(single: tuple[Setup, Results]) -> None:
    """The sum of bottles made rises all the time: no batches of it are independent."""
    method, gap = verdicts(single[1])
    assert missing(method, ["one run", "point", "throughput", "queue", "made", "batch means"]) == []
    assert gap.startswith("made: ")
    facts = ["no interval", "rate 4", "rate 6", "too short", "batches", "independent", "longer run", "more seeds"]
    assert missing(gap, facts) == []
