# SPDX-License-Identifier: Apache-2.0
"""The dialect of a program: how it is chosen, and what it decides (`cases/dialects.yaml` has the language)."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import pytest
from click.testing import CliRunner
from facts import missing, stating

from conveyor_sim.cli import main
from conveyor_sim.control.scan import ControlError
from conveyor_sim.control.st import StructuredText
from conveyor_sim.control.st.controller import MOST_WARNINGS
from conveyor_sim.control.st.dialect import DIALECTS, Dialect
from conveyor_sim.control.st.load import load

WRITES = "FUNCTION f : INT VAR_INPUT x : INT; END_VAR x := 1; f := x; END_FUNCTION PROGRAM main ; END_PROGRAM"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Return a program that iec refuses, and codesys accepts."""
    file = tmp_path / "p.st"
    file.write_text(WRITES)
    return file


def test_the_caller_chooses_the_dialect(path: Path) -> None:
    with pytest.raises(ControlError, match=stating("p.st:1:45", "found x, an input", "codesys", "twincat")):
        StructuredText(path)
    assert StructuredText(path, dialect="codesys").program.instances
    assert load(str(path), {"dialect": "twincat"})


@pytest.mark.parametrize("wrong", ["CODESYS", "st", 3, None, ["iec"], "x" * 5000])
def test_an_unknown_dialect_is_refused(path: Path, wrong: object) -> None:
    with pytest.raises(ControlError, match=stating("p.st", "dialect", *DIALECTS)) as caught:
        load(str(path), {"dialect": wrong})
    assert len(str(caught.value)) < 1000
    with pytest.raises(ControlError, match=stating("dialect", *DIALECTS)):
        StructuredText(path, dialect="nothing")


def test_a_snapshot_fits_its_dialect_only(path: Path) -> None:
    path.write_text("PROGRAM main ; END_PROGRAM")
    plain, other = StructuredText(path), StructuredText(path, dialect="codesys")
    other.restore(other.snapshot())
    with pytest.raises(ControlError):
        other.restore(plain.snapshot())


def test_run_takes_the_dialect(path: Path) -> None:
    scene = Path(__file__).parents[2] / "testing" / "table.yaml"
    arguments = ["run", str(scene), "--duration", "0.05", "--no-record", "--controller", str(path)]
    refused = CliRunner().invoke(main, arguments)
    assert refused.exit_code == 1
    assert not missing(refused.output, "p.st:1:45", "codesys")
    done = CliRunner().invoke(main, [*arguments, "--parameters", "{dialect: codesys}"])
    assert done.exit_code == 0, done.output


def test_every_flag_has_a_row_and_a_dialect() -> None:
    flags = [one for one in fields(Dialect) if one.name != "name"]
    rows = [one.metadata["row"] for one in flags]
    assert len(set(rows)) == len(rows)
    for one in flags:
        assert not getattr(DIALECTS["iec"], one.name)
        assert any(getattr(dialect, one.name) for dialect in DIALECTS.values())


def test_conversions_that_may_change_a_value_are_reported(path: Path) -> None:
    path.write_text(
        "PROGRAM main VAR n : INT; d : DINT; w : WORD; u : UINT; END_VAR\n"
        "n := d; w := u + 1; n := d / 100000;\nn := w;\nEND_PROGRAM"
    )
    plc = StructuredText(path, dialect="codesys")
    first, second = plc.left_over
    assert not missing(first, "p.st:2:6", "DINT", "INT")
    assert not missing(second, "p.st:3:6", "WORD", "INT")


def test_many_warnings_are_counted(path: Path) -> None:
    lines = "n := d;\n" * 100
    path.write_text(f"PROGRAM main VAR n : INT; d : DINT; END_VAR\n{lines}END_PROGRAM")
    listed = StructuredText(path, dialect="codesys").left_over
    assert len(listed) == MOST_WARNINGS + 1
    assert not missing(listed[-1], str(100 - MOST_WARNINGS))
