# SPDX-License-Identifier: Apache-2.0
"""The page of published experiments is made from stored runs, and counts misses as misses."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest
from facts import missing
from published.studies import NAMES, module, source

from conveyor_sim.errors import ConveyorError

Range, Row = module("source").Range, module("source").Row
STORE, PAGE = module("store"), module("page")


def test_the_page_is_what_the_stored_runs_give() -> None:
    assert PAGE.PAGE.read_text(encoding="utf-8") == PAGE.page()


@pytest.mark.parametrize("name", NAMES)
def test_stored_runs_are_cases_of_the_source(name: str) -> None:
    """Rows of CSV files that no case includes would be left out of the page unnoticed."""
    of = source(name)
    lines = STORE.table(of).read_text(encoding="utf-8").splitlines() if STORE.table(of).exists() else [""]
    assert len(STORE.read(of)) == len(lines) - 1 if lines != [""] else not STORE.read(of)
    cases = of.cases()
    assert len({STORE.key(of, case) for case in cases}) == len(cases)


@pytest.mark.parametrize("name", NAMES)
def test_a_source_is_compared_before_it_has_been_run(name: str) -> None:
    rows = source(name).rows([])
    assert rows
    assert {row.verdict for row in rows} <= {"not run"}


def test_every_picture_and_table_belongs_to_a_source() -> None:
    files = {file.name for file in STORE.FOLDER.iterdir()}
    assert files <= {f"{name}{suffix}" for name in NAMES for suffix in (".csv", ".svg")}


@pytest.mark.parametrize(
    ("published", "simulated", "verdict"),
    [
        (Range.within(1.0, 0.1), Range.within(1.15, 0.06), "agrees"),
        (Range.within(1.0, 0.1), Range.within(1.15, 0.04), "disagrees"),
        (Range.exact(1.0), Range.exact(1.0), "agrees"),
        (Range.exact(1.0), None, "not run"),
        (Range.exact(1.0), Range.of_mean([]), "not run"),
    ],
)
def test_figures_agree_if_their_intervals_overlap(published: object, simulated: object, verdict: str) -> None:
    assert Row("x", published, simulated).verdict == verdict


def test_intervals_of_shares_and_slopes() -> None:
    """Wilson's interval of 3 of 6 is 0.188 to 0.812; a line has a slope without an error."""
    share = Range.of_share(3, 6)
    assert (share.low, share.high) == pytest.approx((0.1876, 0.8124), abs=1e-3)
    assert Range.of_share(0, 6).low == 0.0
    slope = Range.of_slope([1.0, 2.0, 4.0], [3.0, 5.0, 9.0])
    assert tuple(slope) == pytest.approx((2.0, 2.0, 2.0))
    assert math.isinf(Range.of_mean([1.0]).high)


def test_numbers_of_a_table_show_their_interval() -> None:
    assert re.findall(r"[\d.]+", PAGE.text_of(Range.within(0.1234, 0.002))) == ["0.1234", "0.1214", "0.1254"]


def test_claims_without_a_number_have_one_end() -> None:
    assert [PAGE.text_of(Range.above(1.5)), PAGE.text_of(Range.below(0.25))] == ["above 1.5", "below 0.25"]
    assert Range.above(1.5).overlaps(Range.within(2.2, 0.6))
    assert not Range.above(1.5).overlaps(Range.within(1.0, 0.4))


@pytest.mark.parametrize("text", ["load,cpu_s\nheld,1\n", "load,h/R,mu h/R,index,cpu_s\nheld,3\n"])
def test_a_damaged_table_is_refused_with_file_and_line(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(STORE, "FOLDER", tmp_path)
    (tmp_path / "tipping.csv").write_text(text)
    with pytest.raises(ConveyorError) as refused:
        STORE.read(source("tipping"))
    assert missing(str(refused.value), "tipping.csv", "line 2", "mu h/R") == []
