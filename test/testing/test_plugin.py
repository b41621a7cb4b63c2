# SPDX-License-Identifier: Apache-2.0
"""The pytest plugin: what a failed test leaves and tells, and that a test that passes leaves nothing."""

import subprocess
import sys
from importlib.metadata import entry_points

import pytest
from facts import missing
from testing.conftest import ON_TABLE, STOP, TABLE
from testing.test_documented import PLUGIN
from testing.test_scenario import FEEDER, Hold

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.testing import Scenario
from conveyor_sim.testing.evidence import came, failure_of, traced

TESTS = f"""
import pytest

TABLE = {str(TABLE)!r}

def test_passes(line):
    line(TABLE).run_for(0.1)

def test_fails(line):
    table = line(TABLE, {{"seed": 3}})
    table.run_for(0.5)
    table.inject({STOP!r})
    table.eventually(lambda s: s[{ON_TABLE!r}] > 90, within=0.5)

@pytest.mark.parametrize("what", ["a b/c"])
def test_of_two_lines(line, what):
    lines = [line(TABLE), line(TABLE)]
    assert lines[1].simulation.tick == 1, "not yet"

def test_moves_bottles_by_hand(line):
    table = line(TABLE)
    table.run_for(2.0)
    with table.simulation.editing() as (bottles, slots):
        bottles.x[slots] += 0.01
    assert table.simulation.tick == 1

@pytest.mark.xfail(strict=True)
def test_known_to_fail(line):
    line(TABLE).always(lambda s: False, for_=0.1)

@pytest.fixture
def busy(line):
    table = line(TABLE)
    table.run_until(lambda s: s[{ON_TABLE!r}] > 90, within=0.05)
    return table

def test_that_cannot_begin(busy):
    pass
"""


@pytest.fixture
def run(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.RunResult:
    """A run of these tests, temporary folders in `temporary`."""
    (pytester.path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(pytester.path / "temporary"))
    pytester.makepyfile(test_table=TESTS)
    return pytester.runpytest_inprocess(*PLUGIN, "--line-failures", "kept")


def test_a_failure_leaves_bag_and_picture_and_tells_where(run: pytest.RunResult, pytester: pytest.Pytester) -> None:
    run.assert_outcomes(passed=1, failed=3, xfailed=1, errors=1)
    kept = pytester.path / "kept"
    names = ["fails", "moves_bottles_by_hand", "of_two_lines_a_b_c", "that_cannot_begin"]
    assert sorted(folder.name for folder in kept.iterdir()) == [f"test_table.py_test_{name}" for name in names]
    assert not list((pytester.path / "temporary").iterdir())

    folder = kept / "test_table.py_test_fails"
    text = "eventually(s['belts/table/bottles'] > 90) did not come true within 0.5 s, from 0.50 s to 1.00 s"
    assert f"E       AssertionError: {text}; the signals that it reads:\n" in run.stdout.str()
    assert f"\nbag: {folder}/bag\npage: {folder}/line.html\npicture: {folder}/line.png\n" in run.stdout.str()
    assert (folder / "line.html").read_text().count('data-part="block/') == 1
    assert (folder / "line.png").read_bytes().startswith(b"\x89PNG")
    with open_bag(folder / "bag") as bag:
        assert bag.counts["signals"] == 101  # from the start to the moment of failure
        assert bag.line.seed == 3
        (outcome,) = (frame.data for frame in bag.outcomes())
        assert (outcome.source, outcome.names, outcome.accepted) == ("fault", (STOP,), True)

    second = kept / "test_table.py_test_of_two_lines_a_b_c" / "line_2"
    assert (second / "line.png").exists() and (second / "bag" / "metadata.yaml").exists()
    # What can't be made again is said so.
    run.stdout.fnmatch_lines([f"bag: {kept}/test_table.py_test_moves_*/bag (the repeated run differs at 2.00 s *"])
    # The report ends where the test does, not inside of the kit.
    assert "scenario.py" not in run.stdout.str()


def test_what_cannot_be_kept_is_told(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_table=TESTS)
    (pytester.path / "kept").write_text("a file in the way")
    result = pytester.runpytest_inprocess(*PLUGIN, "--line-failures", "kept", "-k", "test_fails")
    result.assert_outcomes(failed=1, deselected=5)
    result.stdout.fnmatch_lines(["bag: not saved: *", "page: not saved: *", "picture: not saved: *"])


def test_another_run_replaces_what_the_last_one_left(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_table=TESTS)
    place = pytester.path / "line-failures" / "test_table.py_test_fails"
    (place / "bag").mkdir(parents=True)
    (place / "bag" / "old").touch()
    pytester.runpytest_inprocess(*PLUGIN, "-k", "test_fails").assert_outcomes(failed=1, deselected=5)
    assert sorted(file.name for file in (place / "bag").iterdir()) == ["bag_0.mcap", "metadata.yaml"]


def test_pytest_finds_it_by_itself() -> None:
    """The installed entry point; after an edit of setup.py, `make` updates it."""
    assert PLUGIN[1] in {entry.value for entry in entry_points(group="pytest11")}


def test_it_costs_a_run_that_does_not_use_it_nothing() -> None:
    heavy = "{'numpy', 'numba', 'matplotlib', 'pydantic'}"
    code = f"import conveyor_sim.testing.plugin, sys; print({heavy} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


def test_the_page_of_a_failure_states_condition_values_and_the_last_action() -> None:
    table = Scenario(TABLE)
    table.run_for(0.5)
    table.inject(STOP)
    table.run_for(0.25)
    with pytest.raises(AssertionError):
        table.always(lambda s: s[ON_TABLE] > 90)
    failure = failure_of(table)
    assert missing(failure.text, f"always: {ON_TABLE} > 90", ["false", "0.75"]) == [] and "s[" not in failure.text
    assert failure.values == {ON_TABLE: table.signals[ON_TABLE]} and failure.since == failure.time == 0.75
    assert failure.action is not None and failure.time - failure.action.time == pytest.approx(0.25)
    assert missing(failure.action.text, [STOP, "1"]) == []
    plain = failure_of(Scenario(TABLE), "assert 1 == 2")
    assert missing(plain.text, "assert 1 == 2") == [] and plain.action is None and plain.values == {}


def test_what_is_traced() -> None:
    """The last conditions' signals first, then alarms, commands, and what the controller reads."""
    table = Scenario(TABLE)
    table.attach(Hold(2))
    table.run_for(0.1)
    table.run_until(lambda s: s["machines/packer/running"], within=1)
    with pytest.raises(AssertionError):
        table.always(lambda s: s["infeeds/lane_1/fed"] > 90, for_=1)
    assert traced(table) == [
        "infeeds/lane_1/fed", "machines/packer/running", "belts/feeder/cmd_speed", ON_TABLE,
    ]  # fmt: skip


def test_alarms_are_traced_that_came_in_their_order() -> None:
    table = Scenario(TABLE, {"alarms": {"one": {"tag": ON_TABLE, "high": 0}, "never": {"tag": ON_TABLE, "high": 99}}})
    table.attach(Hold(1))
    table.run_until(lambda s: s["alarms/full"], within=10)
    assert came(table.history) == ["alarms/one", "alarms/full"]
    assert traced(table)[:3] == ["alarms/full", "alarms/one", FEEDER]
