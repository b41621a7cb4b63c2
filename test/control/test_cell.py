# SPDX-License-Identifier: Apache-2.0
"""Controllers of cells."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest
from control.scans import Scans

from conveyor_sim.control import Alarm, ControlError, Inputs, in_cell, together
from conveyor_sim.control.recorded import RecordedVariables
from conveyor_sim.control.scan import LineTags, bind, declared_alarms
from conveyor_sim.control.st.load import load


class Stop:
    """Stops a belt while an eye is blocked, and counts its scans."""

    declared_alarms = (
        Alarm("full", tag="photo_eyes/end/blocked", suppressed_by=("power", "machines/filler/jammed"), group="first"),
        Alarm("power"),
    )
    record = ("scans",)

    def __init__(self) -> None:
        self.scans = 0
        self.seen: dict[str, float] = {}

    @property
    def variables(self) -> Mapping[str, float]:
        return {"scans": float(self.scans)}

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        self.scans += 1
        self.seen = dict(inputs)
        blocked = inputs["photo_eyes/end/blocked"]
        return {"belts/lane/run": 1.0 - blocked, "alarms/full": blocked}


SIGNALS = {"photo_eyes/a_end/blocked": 1.0, "photo_eyes/b_end/blocked": 0.0, "photo_eyes/end/blocked": 0.5}


def test_the_same_controller_runs_several_cells() -> None:
    first, second = Stop(), Stop()
    both = together(in_cell(first, "a"), in_cell(second, "b"))
    answer = Scans(both).scan(SIGNALS)
    expected = {"belts/a_lane/run": 0.0, "alarms/a_full": 1.0, "belts/b_lane/run": 1.0, "alarms/b_full": 0.0}
    assert answer == expected
    assert first.seen == {"photo_eyes/end/blocked": 1.0}
    recorded = RecordedVariables(both)
    assert (sorted(recorded.names), recorded.values()) == (["a_scans", "b_scans"], (1.0, 1.0))


def test_a_cell_in_a_cell() -> None:
    nested = in_cell(in_cell(Stop(), "block"), "a")
    answer = Scans(nested).scan({"photo_eyes/a_block_end/blocked": 1.0})
    assert answer == {"belts/a_block_lane/run": 0.0, "alarms/a_block_full": 1.0}


def test_a_signal_of_another_cell_is_none() -> None:
    with pytest.raises(ControlError, match="photo_eyes/end/blocked: no such signal"):
        Scans(in_cell(Stop(), "c")).scan(SIGNALS)


def test_alarms_get_the_prefix() -> None:
    full, power = declared_alarms(in_cell(Stop(), "a"))
    assert (full.id, full.tag, full.group) == ("a_full", "photo_eyes/a_end/blocked", "a_first")
    assert full.suppressed_by == ("a_power", "machines/a_filler/jammed")
    assert (power.id, power.tag, power.group) == ("a_power", None, "")


PROGRAM = """PROGRAM stop
VAR
  {tag: photo_eyes/end/blocked} blocked AT %IX0.0 : BOOL;
  {tag: belts/lane/run} run AT %QX0.0 : BOOL;
END_VAR
run := NOT blocked;
END_PROGRAM
"""


def test_a_program_is_bound_to_the_tags_of_its_cell(tmp_path: Path) -> None:
    (tmp_path / "stop.st").write_text(PROGRAM)
    programs = [in_cell(load(str(tmp_path / "stop.st")), cell) for cell in "ab"]
    commands = {f"belts/{cell}_lane/run": "bool" for cell in "ab"}
    for program in programs:
        bind(program, LineTags(dict.fromkeys(SIGNALS, "bool"), commands, dict.fromkeys(commands, (0.0, 1.0))))
    both = together(*programs)
    assert Scans(both).scan(SIGNALS) == {"belts/a_lane/run": 0.0, "belts/b_lane/run": 1.0}
    assert RecordedVariables(both, ["b_stop/run"]).values() == (1.0,)
    with pytest.raises(ControlError, match="cell c: no signal of this line has the prefix c_"):
        bind(in_cell(programs[0], "c"), LineTags(dict.fromkeys(SIGNALS, "bool"), commands))
