# SPDX-License-Identifier: Apache-2.0
"""A run without ROS: the same bits as any other, and a whole bag however it ends."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from bag.small_line import SMALL_LINE

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.errors import BagError
from conveyor_sim.line.run_state import ENDED, RUNNING, STOPPED, RunState
from conveyor_sim.run.runner import run_scene
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation


def told_of_run(bag: Path) -> list[tuple[int, RunState]]:
    """Ticks, and what the run was doing from them on."""
    with open_bag(bag) as opened:
        return [(frame.tick, frame.data) for frame in opened.read("run_state")]


def test_run_records_the_whole_duration(tmp_path: Path) -> None:
    told: list[float] = []
    run = run_scene(load_scene(SMALL_LINE), tmp_path / "run", told.append)
    assert run.simulated == pytest.approx(1.0)
    assert not run.interrupted
    assert told == sorted(told)
    assert told[-1] == pytest.approx(1.0)
    report = replay(tmp_path / "run")
    assert report.difference is None
    assert report.last_tick == 100
    assert told_of_run(tmp_path / "run") == [(0, RunState(RUNNING)), (100, RunState(ENDED))]


def test_the_largest_force_is_that_of_the_recording(tmp_path: Path) -> None:
    run = run_scene(load_scene(SMALL_LINE), tmp_path / "run")
    alone = run_scene(load_scene(SMALL_LINE), None)
    with open_bag(tmp_path / "run") as bag:
        assert run.peak_force == max(frame.data.peak_force.max() for frame in bag.bottles())
    assert alone.peak_force == run.peak_force


def test_recorded_state_is_that_of_the_bare_simulation(tmp_path: Path) -> None:
    scene = load_scene(SMALL_LINE)
    run_scene(scene, tmp_path / "run")
    simulation = Simulation(scene)
    simulation.advance(100)
    with open_bag(tmp_path / "run") as bag:
        last = list(bag.bottles())[-1]
    assert last.tick == 100
    for name, values in vars(simulation.bottles()).items():
        assert getattr(last.data, name).tobytes() == values.tobytes(), name


def test_two_runs_record_the_same_bottles(tmp_path: Path) -> None:
    recorded = []
    for name in ("first", "second"):
        run_scene(load_scene(SMALL_LINE), tmp_path / name)
        with open_bag(tmp_path / name) as bag:
            recorded.append(list(bag.raw({"bottles", "contacts"})))
    assert recorded[0] == recorded[1]


def test_run_without_a_recording_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run = run_scene(load_scene(SMALL_LINE), None)
    assert run.bag is None
    assert list(tmp_path.iterdir()) == []


def test_path_that_can_not_be_written_is_refused_before_anything_runs(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    told: list[float] = []
    with pytest.raises(BagError, match="can't be created"):
        run_scene(load_scene(SMALL_LINE), tmp_path / "file" / "run", told.append)
    assert told == []


LONG_RUN = """
import sys
from pathlib import Path
from bag.small_line import SMALL_LINE
from conveyor_sim.run.runner import run_scene
from conveyor_sim.scene import load_scene
scene = load_scene(SMALL_LINE, {"duration": 1e6})
run = run_scene(scene, Path(sys.argv[1]), lambda done: print(done, flush=True))
print("interrupted" if run.interrupted else "to the end")
"""


@pytest.mark.parametrize("request_", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_run_ends_with_a_whole_bag(tmp_path: Path, request_: signal.Signals) -> None:
    folder = tmp_path / "run"
    process = subprocess.Popen(
        [sys.executable, "-c", LONG_RUN, str(folder)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[1],
    )
    assert process.stdout is not None
    for _ in range(20):
        process.stdout.readline()
    process.send_signal(request_)
    out, err = process.communicate()
    assert process.returncode == 0, err
    assert out.splitlines()[-1] == "interrupted"
    report = replay(folder)
    assert report.difference is None
    assert report.last_tick >= 20
    assert told_of_run(folder) == [(0, RunState(RUNNING)), (report.last_tick, RunState(STOPPED, "on request"))]
