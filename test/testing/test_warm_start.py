# SPDX-License-Identifier: Apache-2.0
"""The fixture `warm_start`: a line is warmed up once for many tests."""

from pathlib import Path

import pytest
from testing.conftest import STOP, TABLE
from testing.test_documented import PLUGIN
from warm import run

from conveyor_sim.bag.replay import replay

TESTS = f"""
import os
from pathlib import Path

import pytest

from conveyor_sim.control import Constant

TABLE = {str(TABLE)!r}
WARM_UPS = Path("warm_ups")

def fill(table):
    WARM_UPS.mkdir(exist_ok=True)
    (WARM_UPS / f"{{os.getpid()}}_{{len(list(WARM_UPS.iterdir()))}}").touch()
    table.inject({STOP!r})
    table.run_until(lambda s: s["belts/table/bottles"] >= 2, within=20)

@pytest.fixture(scope="session")
def full(warm_start):
    return warm_start(TABLE, fill)

@pytest.mark.parametrize("number", range(4))
def test_starts_full(line, full, number):
    table = line(TABLE, start=full)
    assert table.signals["belts/table/bottles"] == 2
    table.attach(Constant({{"belts/table/cmd_speed": 0.1 * number}}))
    table.run_for(1.0)
    Path(f"hash_{{number}}").write_text(f"{{table.simulation.state_hash():x}}")

def test_no_more_than_once(warm_start, full):
    assert warm_start(TABLE, fill) == full
    assert warm_start(TABLE, fill, {{"seed": 2}}) != full

def test_fails(line, full):
    line(TABLE, start=full).always(lambda s: s["belts/table/bottles"] < 2, for_=1.0)

@pytest.fixture
def never_full(warm_start):
    return warm_start(TABLE, lambda table: table.run_until(lambda s: s["belts/table/bottles"] > 90, within=0.5))

def test_that_cannot_begin(never_full):
    pass
"""
PASS = ("-k", "starts_full")


def hashes(folder: Path) -> list[str]:
    return [(folder / f"hash_{number}").read_text() for number in range(4)]


def test_one_warm_up_for_many_tests_each_with_a_line_of_its_own(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_warm=TESTS)
    result = pytester.runpytest_inprocess(*PLUGIN)
    result.assert_outcomes(passed=5, failed=1, errors=1)
    assert len(list((pytester.path / "warm_ups").iterdir())) == 2  # of two seeds
    assert len(set(hashes(pytester.path))) == 4

    kept = pytester.path / "line-failures"
    names = ["test_fails", "test_that_cannot_begin_warm_up"]
    assert sorted(folder.name for folder in kept.iterdir()) == [f"test_warm.py_{name}" for name in names]
    report = replay(kept / "test_warm.py_test_fails" / "bag")
    assert report.exact and report.difference is None and report.first_tick > 0
    report = replay(kept / "test_warm.py_test_that_cannot_begin_warm_up" / "bag")
    assert report.exact and report.difference is None and (report.first_tick, report.last_tick) == (0, 50)
    result.stdout.fnmatch_lines(["*line at the moment when its warm-up failed*"])


def test_processes_of_xdist_do_not_tread_on_each_other(tmp_path: Path) -> None:
    """Runs in another process, with the kernels that this one has compiled."""
    found = []
    for workers in ("0", "2"):
        folder = tmp_path / workers
        folder.mkdir()
        (folder / "test_warm.py").write_text(TESTS)
        command = ["-m", "pytest", *PLUGIN, *PASS, "-n", workers, f"--basetemp={tmp_path / 'base'}"]
        done = run(command, cwd=folder)
        assert done.returncode == 0 and "4 passed" in done.stdout, done.stdout
        found.append(hashes(folder))
        processes = [path.name.split("_")[0] for path in (folder / "warm_ups").iterdir()]
        assert len(processes) == len(set(processes)) == max(int(workers), 1)  # once in each
        assert not (folder / "line-failures").exists()
    assert found[0] == found[1]
