# SPDX-License-Identifier: Apache-2.0
"""Study of public PLC code: the stored results, and the reading of tests of other compilers."""

from __future__ import annotations

import csv
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

STUDIES = Path(__file__).parents[3] / "docs" / "studies"


@pytest.fixture
def study(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Put the modules of the study within reach, and take them away again."""
    folder = STUDIES / "structured_text"
    names = {file.stem for file in folder.glob("*.py")}
    monkeypatch.syspath_prepend(str(folder))
    for name in names:
        monkeypatch.delitem(sys.modules, name, raising=False)
    yield
    for name in names:
        sys.modules.pop(name, None)


def stored() -> list[dict[str, str]]:
    with (STUDIES / "structured_text.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_most_units_of_oscat_without_pointers_compile_unchanged() -> None:
    """At least 80 % of the units that use no pointers themselves, and 60 functions with values of closed forms."""
    rows = stored()
    own = Counter(row["result"] for row in rows if row["source"] == "oscat" and row["group"] != "points")
    assert own["right"] / own.total() >= 0.8
    assert own["different"] == 0
    valued = {row["unit"] for row in rows if row["source"] == "oscat values" and row["result"] == "right"}
    assert len(valued) >= 60


@pytest.mark.usefixtures("study")
def test_the_page_has_the_stored_results_and_a_reason_for_every_difference(tmp_path: Path) -> None:
    import page
    import run

    rows = [run.Row(**row) for row in stored()]
    page.write(tmp_path / "page.md", rows)
    made = (tmp_path / "page.md").read_text(encoding="utf-8")
    assert made == (STUDIES / "structured_text.md").read_text(encoding="utf-8")
    assert all(page.reason(row) != "not explained" for row in rows if row.result == "different")
    assert all(row.message for row in rows if row.result != "right")


@pytest.mark.usefixtures("study")
def test_a_unit_is_right_refused_or_different(tmp_path: Path) -> None:
    import run
    from sources import Source
    from units import Check, Part, Unit, files, with_needs

    (tmp_path / "f.st").write_text("FUNCTION f : INT VAR_INPUT x : INT; END_VAR f := g(x) + 1; END_FUNCTION")
    (tmp_path / "g.st").write_text("FUNCTION g : INT VAR_INPUT x : INT; END_VAR g := 2 * x; END_FUNCTION")
    (tmp_path / "h.st").write_text("FUNCTION h : INT VAR_INPUT p : POINTER TO INT; END_VAR h := p^; END_FUNCTION")
    (tmp_path / "i.st").write_text("FUNCTION i : INT i := h(0); END_FUNCTION")
    units = {unit.name: unit for unit in with_needs(files(tmp_path, (".st",)))}
    assert [part.name for part in units["f.st"].parts] == ["f.st", "g.st"]
    assert [units[f"{name}.st"].group for name in "fghi"] == ["", "", "points", "needs pointers"]
    source = Source("key", "somebody/folder", "0", "", "codesys", lambda folder: iter(()))
    results = {name: run.judged(source, unit) for name, unit in units.items()}
    assert [results[f"{name}.st"].result for name in "fghi"] == ["right", "right", "refused", "refused"]
    main = Part("main", "PROGRAM main VAR n : INT; END_VAR n := f(20); END_PROGRAM")
    for value, result in ((41, "right"), (40, "different")):
        checked = Unit("main", (main, *units["f.st"].parts), (Check("main/n", value),))
        assert run.judged(source, checked).result == result


@pytest.mark.usefixtures("study")
def test_values_of_tests_in_rust_are_read() -> None:
    from rust import number

    assert [number(one) for one in ("-5i32", "0b1100_1000", "i16::MAX", "2.5f32", "true", "3_000_000_000")] == [
        *(-5, 200, 32767, 2.5, True, 3_000_000_000)
    ]
    assert number("maintype.a.abs()") is None


@pytest.mark.usefixtures("study")
def test_assertions_of_strucpp_become_variables(tmp_path: Path) -> None:
    import run
    import strucpp
    from sources import Source

    folder = tmp_path / "tests" / "st-validation" / "timers"
    folder.mkdir(parents=True)
    (folder / "t.st").write_text("FUNCTION twice : INT VAR_INPUT x : INT; END_VAR twice := 2 * x; END_FUNCTION")
    (folder / "test_t.st").write_text(
        "TEST 'a timer' VAR t : TON; END_VAR t(IN := TRUE, PT := T#20ms); ASSERT_FALSE(t.Q);\n"
        "ADVANCE_TIME(T#20ms); t(IN := TRUE, PT := T#20ms); ASSERT_TRUE(t.Q); ASSERT_EQ(twice(2), 4); END_TEST\n"
        "TEST 'wrong' VAR x : REAL; END_VAR ASSERT_NEAR(x, 0.5, 0.1); END_TEST"
    )
    source = Source("key", "somebody/folder", "0", "", "codesys", lambda folder: strucpp.units(folder, "others"))
    assert [run.judged(source, unit).result for unit in source.units(tmp_path)] == ["right", "different"]
