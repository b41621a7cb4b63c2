# SPDX-License-Identifier: Apache-2.0
"""A process that is killed, a full disk, Ctrl-C: finished runs are kept, and the study goes on."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from facts import missing, stating
from studies.small import setup_of, write_study
from studies.waiting import PATIENCE, until
from warm import Warm, run

from conveyor_sim.studies.journal import read_rows
from conveyor_sim.studies.row import Job
from conveyor_sim.studies.run import run_alone
from conveyor_sim.studies.runs import Runs
from conveyor_sim.studies.sweep import sweep
from conveyor_sim.support.worker_pool import WorkerPool

RATES = {"rate": {"argument": "rate", "values": [6.0, 7.0, 8.0]}}


@pytest.mark.parametrize("deaths", [1, 2])
def test_a_process_that_is_killed_takes_no_other_run_along(tmp_path: Path, deaths: int) -> None:
    """Killed once, its run is made by another; killed twice, the run is lost, until the study is run again."""
    arguments = {"folder": str(tmp_path), "deaths": deaths}
    setup = setup_of(tmp_path, function="code.py:deadly", arguments=arguments, parameters=RATES, seeds=1, duration=0.1)
    with Runs(setup, tmp_path / "out", WorkerPool(2)) as runs:
        # Not compiled in this process, which would die.
        rows = runs.run([Job(point, {"rate": rate}, 1) for point, rate in enumerate((6.0, 7.0, 8.0))])
    assert [row.status for row in rows] == ["finished", "finished" if deaths == 1 else "lost", "finished"]
    if deaths == 2:
        assert missing(rows[1].error, ["process", "ended", "twice", "killed", "out of memory"]) == []
        with Runs(setup, tmp_path / "out", WorkerPool(1)) as runs:
            rows = runs.run([Job(1, {"rate": 7.0}, 1)])
        assert rows[0].status == "finished"
    assert [row.status for row in read_rows(tmp_path / "out")] == ["finished"] * 3


FULL = """
import resource, sys
from pathlib import Path
from conveyor_sim.studies.load import load_study
from conveyor_sim.studies.runs import Runs
from conveyor_sim.studies.sweep import sweep

def fill(done, total, left, row):
    if done == 2:
        resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))

if __name__ == "__main__":
    setup = load_study(sys.argv[1])
    with Runs(setup, Path(sys.argv[2])) as runs:
        sweep(runs, setup, fill)
"""


def test_a_full_disk_loses_no_finished_run(tmp_path: Path) -> None:
    study = write_study(tmp_path, parameters=RATES, duration=0.1)
    (tmp_path / "full.py").write_text(FULL)
    command = [sys.executable, str(tmp_path / "full.py"), str(study), str(tmp_path / "out")]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    assert missing(ended.stderr, ["File too large", "2 finished runs", "same command"]) == []
    kept = read_rows(tmp_path / "out")
    assert len(kept) == 2
    assert not list((tmp_path / "out" / "runs").glob(".*"))
    setup = setup_of(tmp_path, parameters=RATES, duration=0.1)
    with Runs(setup, tmp_path / "out", WorkerPool(1)) as runs:
        rows = sweep(runs, setup)
    assert [row.status for row in rows] == ["finished"] * 6
    assert [row for row in rows if row.key in {row.key for row in kept}] == kept


def test_ctrl_c_ends_it_and_says_how_to_go_on(tmp_path: Path) -> None:
    study = write_study(tmp_path, function="code.py:gated", arguments={"folder": str(tmp_path)}, duration=0.1, seeds=1)
    out = tmp_path / "out"
    code = f"import os; open({str(tmp_path / 'main')!r}, 'w').write(str(os.getpid()))"
    sweep_it = ["-c", f"{code}; from conveyor_sim.cli import main; main()", "sweep", str(study)]
    with (tmp_path / "said").open("w") as log:
        process = Warm([*sweep_it, "--out", str(out), "--processes", "2"], log, log)
    try:
        until(lambda: list(out.glob("runs/*.json")), "a finished run")
        until(lambda: list(tmp_path.glob("running_*")), "a run that waits")
        process.send_signal(signal.SIGINT)
        process.wait(PATIENCE)
    finally:
        process.kill()
    said = (tmp_path / "said").read_text()
    assert process.returncode == 130
    assert missing(said, ["finished runs", str(out), "same command"]) == []
    assert "Traceback" not in said
    (pid,) = (int(path.name.partition("_")[2]) for path in tmp_path.glob("running_*"))
    until(lambda: not _is_alive(pid), "the end of the process that ran it")
    (finished,) = read_rows(out)
    (tmp_path / "go").touch()
    ended = run([*sweep_it, "--out", str(out)], timeout=PATIENCE)
    assert ended.returncode == 0, ended.stderr
    assert f": conveyor-sim sweep {study} --set rate=4.0 --seed 1" in ended.stdout
    rows = read_rows(out)
    assert len(rows) == 2 and rows[0] == finished


def _is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_a_run_alone_raises_what_fails_in_it(tmp_path: Path) -> None:
    setup = setup_of(tmp_path, function="code.py:line", overrides={"bottle_types": {"bottle": {"radius": -1.0}}})
    with pytest.raises(Exception, match=stating("bottle_types.bottle.radius", "-1", "a number greater than 0")):
        run_alone(setup, Job(0, {"rate": 4.0}, 1), None)
