# SPDX-License-Identifier: Apache-2.0
"""Progress on terminals and elsewhere."""

import io

import pytest
from facts import missing
from rich.console import Console

from conveyor_sim.support.progress import ProgressBar


def test_plain_lines_where_there_is_no_terminal() -> None:
    out = io.StringIO()
    with ProgressBar("line", 2.0, Console(file=out, force_terminal=False)) as bar:
        for tick in range(201):
            bar.update(tick * 0.01)
    lines = out.getvalue().splitlines()
    assert len(lines) == 10
    assert lines[-1].startswith("line: 2.0 of 2.0 s, ")
    assert lines[-1].endswith(" x real time")
    assert all(missing(line, ["about", "s left"]) == [] for line in lines[:-1])


@pytest.mark.parametrize(
    ("counted", "total", "said"),
    [
        ("", 0.01, ["line: 0.010 of 0.010 s"]),
        ("", 0.2, ["line: 0.10 of 0.20 s", "line: 0.20 of 0.20 s"]),
        ("s", 0.02, ["line: 0.010 of 0.020 s", "line: 0.020 of 0.020 s"]),
        ("s", 2.0, ["line: 1 of 2 s", "line: 2 of 2 s"]),
    ],
)
def test_short_times_are_not_rounded_to_0(counted: str, total: float, said: list[str]) -> None:
    out = io.StringIO()
    with ProgressBar("line", total, Console(file=out, force_terminal=False), counted) as bar:
        for part in range(1, len(said) + 1):
            bar.update(total * part / len(said))
    assert [line.partition(", ")[0] for line in out.getvalue().splitlines()] == said


def test_bar_on_a_terminal_ends_at_the_whole() -> None:
    out = io.StringIO()
    with ProgressBar("line", 0.0, Console(file=out, force_terminal=True, width=100)) as bar:
        bar.update(0.5, total=1.0)
        bar.update(1.0, total=1.0)
    assert "100%" in out.getvalue()


def test_time_left_that_the_caller_knows_is_shown_and_no_guess_beside_it() -> None:
    out = io.StringIO()
    with ProgressBar("settings", 0.0, Console(file=out, force_terminal=False, width=40), counted="runs") as bar:
        bar.update(5, total=10, left=123.4)
    assert missing(out.getvalue(), "settings", "5 of 10 runs", "123 s") == []
    out = io.StringIO()
    with ProgressBar("settings", 0.0, Console(file=out, force_terminal=True, width=100), counted="runs") as bar:
        bar.update(5, total=10, left=123.4)
    assert "at most 123 s left" in out.getvalue()
    assert ":--" not in out.getvalue().splitlines()[-1]
