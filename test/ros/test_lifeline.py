# SPDX-License-Identifier: Apache-2.0
"""Processes that are started end with the process that started them, even if that is killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from ros.line_client import until
from ros.test_main_job import start_main_job

from conveyor_sim.bag.recover import recover
from conveyor_sim.support.child_process import Process

PARENT = """
import os, sys, time
from pathlib import Path
from conveyor_sim.support.child_process import Process
Process("child", sys.argv[2:], os.environ, Path(sys.argv[1]))
print("started", flush=True)
time.sleep(600)
"""
STUBBORN_CHILD = "trap 'echo ended > {0}/ended; exit 3' INT; sleep 600 & echo $! > {0}/grandchild; wait"


def runs(process: int) -> bool:
    """A zombie does not."""
    stat = Path(f"/proc/{process}/stat")
    try:
        return stat.read_text().rpartition(") ")[2][0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def written(file: Path) -> str:
    return str(until(lambda: file.exists() and file.read_text().strip(), str(file)))


def test_a_main_job_that_is_killed_leaves_no_node_and_a_whole_bag(tmp_path: Path) -> None:
    job, processes = start_main_job(tmp_path / "bag")
    assert set(processes) == {"sim_node", "controller_node"}
    job.kill()
    job.wait()
    until(lambda: not any(runs(process) for process in processes.values()), "the end of the nodes")
    assert recover(tmp_path / "bag").healthy


def test_a_command_is_interrupted_and_its_own_children_too(tmp_path: Path) -> None:
    command = ["sh", "-c", STUBBORN_CHILD.format(tmp_path)]
    parent = subprocess.Popen([sys.executable, "-c", PARENT, str(tmp_path), *command])
    grandchild = int(written(tmp_path / "grandchild"))
    parent.kill()
    parent.wait()
    assert written(tmp_path / "ended") == "ended"
    until(lambda: not runs(grandchild), "the end of the command's child")


def test_the_thread_that_started_a_command_may_end(tmp_path: Path) -> None:
    """The thread of a test that attaches a node may end as well."""
    started: list[Process] = []
    command = [sys.executable, "-c", "import time; print('here', flush=True); time.sleep(600)"]
    thread = threading.Thread(target=lambda: started.append(Process("child", command, os.environ, tmp_path)))
    thread.start()
    thread.join()
    assert written(tmp_path / "child.log") == "here"
    assert started[0].exit_code is None
    started[0].stop()
    assert started[0].exit_code == -signal.SIGINT


def test_a_command_s_children_end_with_it(tmp_path: Path) -> None:
    script = f"sleep 600 & echo $! > {tmp_path}/grandchild; exit 4"
    process = Process("child", ["sh", "-c", script], os.environ, tmp_path)
    grandchild = int(written(tmp_path / "grandchild"))
    assert until(lambda: process.exit_code, "the end of the command") == 4
    until(lambda: not runs(grandchild), "the end of the command's child")
    process.stop()


def test_a_missing_command_is_told_at_once(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="no_such_command"):
        Process("child", ["no_such_command"], os.environ, tmp_path)
    assert list(tmp_path.iterdir()) == []
