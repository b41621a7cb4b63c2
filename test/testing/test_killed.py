# SPDX-License-Identifier: Apache-2.0
"""A test that is killed leaves its inputs, of which the bag is made by `conveyor-sim recover`."""

import json
import os
import signal
import time
from pathlib import Path

import pytest
from click.testing import CliRunner
from facts import stating
from testing.conftest import STOP, TABLE
from testing.test_documented import PLUGIN
from testing.test_inputs import messages
from warm import Warm

from conveyor_sim.bag.input_log import FILE_NAME
from conveyor_sim.bag.replay import replay
from conveyor_sim.cli import main
from conveyor_sim.control import Constant
from conveyor_sim.errors import CheckpointError
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.testing import Scenario
from conveyor_sim.testing.evidence import left_over
from conveyor_sim.testing.plugin import Lines

FIRST, REACHED = 300, 925
"""Ticks: of the checkpoint, and at which the test hangs."""

TESTS = f"""
from pathlib import Path
from time import sleep

from conveyor_sim.control import Constant

def play(table):
    table.attach(Constant({{"belts/feeder/cmd_speed": 0.3, "alarms/slow": 1.0}}))
    table.run_for(2.0)
    table.inject({STOP!r})
    table.run_for({(REACHED - FIRST) * 0.01 - 2.0!r})

def test_hangs(line):
    lines = [line({str(TABLE)!r}, start="warm.npz"), line({str(TABLE)!r}, {{"seed": 3}})]
    lines[1].run_for(1.0)
    play(lines[0])
    Path("hangs").touch()
    sleep(600)

def test_passes(line):
    line({str(TABLE)!r}).run_for(0.1)
"""
LEFT = Path("line-failures", "test_killed.py_test_hangs.unfinished")


def pytest_command(*arguments: str) -> list[str]:
    return ["-m", "pytest", *PLUGIN, "-p", "no:xdist", *arguments]


def end_by(kind: signal.Signals, folder: Path) -> None:
    """Run the test that hangs in a separate pytest, in a folder, and end that by a signal at a known tick."""
    (folder / "test_killed.py").write_text(TESTS)
    with Scenario(TABLE) as table:
        table.run_for(FIRST * 0.01)
        table.simulation.save(folder / "warm.npz")
    with (folder / "told").open("w") as told:
        child = Warm(pytest_command("-k", "hangs"), told, told, cwd=folder)
    try:
        end = time.monotonic() + 120.0
        while not (folder / "hangs").exists():
            assert child.poll() is None and time.monotonic() < end, (folder / "told").read_text()
            time.sleep(0.05)
        assert (folder / LEFT).is_dir()
        os.kill(child.pid, kind)
        child.wait(120.0)
    finally:
        child.kill()


@pytest.fixture(scope="module")
def killed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a pytest that was killed."""
    folder = tmp_path_factory.mktemp("killed")
    end_by(signal.SIGKILL, folder)
    return folder


def test_its_inputs_make_the_same_run(killed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(killed)
    done = CliRunner().invoke(main, ["recover", str(LEFT)])
    assert done.exit_code == 0, done.output
    # Less than a simulated second is missing.
    assert (
        f"{LEFT}/bag: the run up to 9.00 s" in done.output and f"{LEFT}/line_2/bag: the run up to 1.00 s" in done.output
    )
    for bag in (LEFT / "bag", LEFT / "line_2" / "bag"):
        report = replay(bag)
        assert report.exact and report.difference is None

    # The states that the killed test had noted are those of such a run in this process.
    noted = [json.loads(text) for text in (LEFT / FILE_NAME).read_text().splitlines()[1:]]
    hashes = {entry["tick"]: entry["hash"] for entry in noted if "hash" in entry}
    assert list(hashes) == [*range(FIRST + 100, REACHED, 100)]
    again = Simulation.load("warm.npz", scene=load_scene(TABLE))
    with Scenario(again.scene, start="warm.npz", bag=Path("whole")) as table:
        table.attach(Constant({"belts/feeder/cmd_speed": 0.3, "alarms/slow": 1.0}))
        for tick in range(FIRST, 900):
            if tick == FIRST + 200:
                table.inject(STOP)
            assert hashes.get(tick, table.simulation.state_hash()) == table.simulation.state_hash()
            table.run_for(0.01)
        assert hashes[900] == table.simulation.state_hash()
    assert messages(LEFT / "bag") == messages(Path("whole"))


def test_the_next_run_says_what_is_left_and_lets_it_be(killed: Path, pytester: pytest.Pytester) -> None:
    root = pytester.path / "line-failures"
    left = root / LEFT.name
    left.mkdir(parents=True)
    for file in ("inputs.jsonl", "start.npz"):
        (left / file).write_bytes((killed / LEFT / file).read_bytes())
    pytester.makepyfile(test_killed=TESTS)
    result = pytester.runpytest_inprocess(*PLUGIN, "-k", "passes")
    result.assert_outcomes(passed=1, deselected=1)
    result.stdout.fnmatch_lines(["*inputs left by killed tests*", f"{left}: `conveyor-sim recover {left}` makes *"])
    assert sorted(file.name for file in left.iterdir()) == ["inputs.jsonl", "start.npz"]
    assert sorted(root.iterdir()) == [left]

    assert CliRunner().invoke(main, ["recover", str(left)]).exit_code == 0
    result = pytester.runpytest_inprocess(*PLUGIN, "-k", "passes")
    result.stdout.no_fnmatch_line("*killed tests have left*")


def test_ctrl_c_leaves_nothing(tmp_path: Path) -> None:
    end_by(signal.SIGINT, tmp_path)
    assert not (tmp_path / "line-failures").exists()


def test_a_test_that_is_running_has_left_nothing(tmp_path: Path) -> None:
    """Two processes may run the same test at once."""
    root = tmp_path / "line-failures"
    one, other = Lines(root / "test"), Lines(root / "test")
    for lines in (one, other):
        lines(TABLE).run_for(0.1)
        with pytest.raises(CheckpointError, match=stating("missing.npz", "no such file", "checkpoint")):
            lines(TABLE, start=tmp_path / "missing.npz")
    names = ["test.unfinished", "test.unfinished_2"]
    assert sorted(folder.name for folder in root.iterdir()) == names
    assert left_over(root) == []
    for lines in (one, other):
        lines.made[0][0].close()  # as far as the file's lock goes, these are dead
    assert left_over(root) == [root / name for name in names]
    other.close()
    assert left_over(root) == [root / names[0]]
    one.close()
    assert not root.exists()
