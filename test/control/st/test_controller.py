# SPDX-License-Identifier: Apache-2.0
"""A program as the controller of a line: tags, refusals, access by tests."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from facts import missing, stating

from conveyor_sim.control.scan import Controller, Inputs, LineTags, together
from conveyor_sim.control.st.controller import StructuredText
from conveyor_sim.control.st.errors import StructuredTextError
from conveyor_sim.control.st.load import load
from conveyor_sim.protocols.modbus.address_map import modbus_map
from conveyor_sim.run.controller_parameters import controller_parameters
from conveyor_sim.support.modbus_rows import to_csv
from conveyor_sim.testing import Scenario
from conveyor_sim.testing.evidence import draw_moment, traced

TAGS = LineTags(
    signals={
        "belts/a/speed": "number",
        "photo_eyes/e/blocked": "bool",
        "zones/z/bottles": "count",
        "machines/m/state": "enumeration",
    },
    commands={"belts/a/cmd_speed": "number", "machines/m/run": "bool"},
)
TABLE = Path(__file__).parent.parent.parent / "testing" / "table.yaml"
PROGRAMS = Path(__file__).parent.parent.parent.parent / "examples" / "st"


def controller(tmp_path: Path, declare: str, body: str = ";", **options: object) -> StructuredText:
    path = tmp_path / "program.st"
    path.write_text(declare if declare.startswith("CONF") else f"PROGRAM main {declare}\n{body}\nEND_PROGRAM\n")
    return StructuredText(path, **options)  # type: ignore[arg-type]


def bound(tmp_path: Path, declare: str, body: str = ";", **options: object) -> StructuredText:
    made = controller(tmp_path, declare, body, **options)
    made.bind(TAGS)
    return made


def scan(plc: StructuredText, tick: int, **signals: float) -> dict[str, float]:
    names = {"speed": "belts/a/speed", "eye": "photo_eyes/e/blocked", "count": "zones/z/bottles"}
    values = dict.fromkeys(TAGS.signals, 0.0) | {names[name]: value for name, value in signals.items()}
    return dict(plc.scan(Inputs(values, tick * 0.01, tick, 0.01)))


def test_variables_are_tags_by_pragma_by_name_and_by_word(tmp_path: Path) -> None:
    plc = bound(
        tmp_path,
        "VAR_INPUT {tag: zones/z/bottles} n : INT; photo_eyes_e_blocked : BOOL; x : LREAL; lost : BOOL; END_VAR "
        "VAR_OUTPUT belts_a_cmd_speed : LREAL; {tag: alarms/full} full : BOOL; END_VAR",
        "belts_a_cmd_speed := x + n; full := photo_eyes_e_blocked;",
        tags={"main/x": "belts/a/speed"},
    )
    assert scan(plc, 0, count=3, speed=0.25, eye=1) == {"belts/a/cmd_speed": 3.25, "alarms/full": 1.0}
    *rows, command = str(plc.mapping).splitlines()
    assert rows == [
        "main/n <- zones/z/bottles (by tag)",
        "main/photo_eyes_e_blocked <- photo_eyes/e/blocked (by name)",
        "main/x <- belts/a/speed (by tag)",
        "main/belts_a_cmd_speed -> belts/a/cmd_speed (by name)",
        "main/full -> alarms/full (by tag)",
        "main/lost: no tag",
    ]
    assert command.startswith("machines/m/run: ")
    assert missing(command, ["command", "not"]) == []
    no_tag, not_given = plc.left_over
    assert missing(no_tag, [str(tmp_path / "program.st"), "no tag", "main/lost"]) == []
    assert missing(not_given, [str(tmp_path / "program.st"), "commands", "not", "machines/m/run"]) == []


def test_located_variables_are_tags_by_their_address_in_the_modbus_map(tmp_path: Path) -> None:
    plant = Scenario(TABLE)
    rows = modbus_map(plant.simulation.process_image.tags)
    kept = tmp_path / "map.csv"
    kept.write_text(to_csv(rows))
    where = {row.name: row for row in rows}
    eye, speed = where["photo_eyes/high/blocked"], where["belts/table/cmd_speed"]
    run, actual = where["machines/packer/run"], where["belts/table/speed"]
    plc = controller(
        tmp_path,
        f"VAR eye AT %IX{eye.address // 8}.{eye.address % 8} : BOOL; speed AT %QD{speed.address} : REAL; "
        f"run AT %QX{run.address} : BOOL; actual AT %ID{actual.address} : REAL; END_VAR",
        "speed := SEL(eye, 0.25, 0.0); run := actual >= 0.0;",
        modbus_map=kept,
    )
    plant.attach(plc)
    plant.run_for(0.05)
    assert plant.history["belts/table/cmd_speed"][-1] == 0.25
    assert plant.history["machines/packer/run"][-1] == 1.0
    assert plant.signals["plc/main/actual"] == plant.signals["belts/table/speed"] == 0.25
    plant.always(lambda s: s["PLC/Main/Actual"] == s["plc/main/actual"], for_=0.05)
    assert plant.history["plc/main/actual"][-1] == 0.25
    with pytest.raises(KeyError, match="plc/main/absent"):
        plant.signals["PLC/Main/Absent"]
    assert "main/eye <- photo_eyes/high/blocked (by address)" in str(plc.mapping)
    wrong = controller(tmp_path, f"VAR speed AT %QW{speed.address} : INT; END_VAR", modbus_map=kept)
    with pytest.raises(StructuredTextError, match=stating(f"%QW{speed.address}", "belts/table/cmd_speed", "32 bits")):
        plant.attach(wrong)


@pytest.mark.parametrize(
    ("declare", "text"),
    [
        ("VAR_OUTPUT {tag: belts/a/speed} x : LREAL; END_VAR", "found belts/a/speed, expected a command"),
        ("VAR_INPUT {tag: belts/a/cmd_speed} x : LREAL; END_VAR", "found belts/a/cmd_speed, expected a signal"),
        ("VAR {tag: belts/b/speed} x : LREAL; END_VAR", "expected one of belts/a/speed, belts/a/cmd_speed"),
        ("VAR {tag: belts/a/speed} x : INT; END_VAR", "found INT for belts/a/speed, a number, expected REAL or LREAL"),
        (
            "VAR {tag: zones/z/bottles} x : BOOL; END_VAR",
            "found BOOL for zones/z/bottles, a count, expected an integer",
        ),
        (
            "VAR {tag: machines/m/run} x : BOOL; {tag: machines/m/run} y : BOOL; END_VAR",
            "machines/m/run: found main/x and main/y for it, expected one variable",
        ),
    ],
)
def test_a_mapping_that_can_not_be_is_refused_before_the_first_scan(tmp_path: Path, declare: str, text: str) -> None:
    with pytest.raises(StructuredTextError) as caught:
        bound(tmp_path, declare)
    assert text in str(caught.value)


@pytest.mark.parametrize(
    ("name", "at", "facts"),
    [
        ("Main/Speeed", "3:1", ("Main/Speeed", "main/speed", "main/eye")),
        ("lid", "1:9", ("lid", "main/speed", "main/eye")),
    ],
)
def test_a_tag_of_an_unknown_variable_is_refused_at_the_closest_one(
    tmp_path: Path, name: str, at: str, facts: tuple[str, ...]
) -> None:
    with pytest.raises(StructuredTextError, match=rf"program\.st:{at}: ") as caught:
        bound(tmp_path, "VAR\neye : BOOL;\nspeed : LREAL; END_VAR", tags={name: "belts/a/speed"})
    assert missing(str(caught.value), facts) == []


@pytest.mark.parametrize(
    ("declare", "at"),
    [
        ("VAR {tag: machines/m/run} x : BOOL;\n{tag: machines/m/run} y : BOOL; END_VAR", "2:23"),
        ("VAR x AT %IX0.0 : BOOL;\ny AT %IW0 : INT; END_VAR", "1:18"),
    ],
)
def test_a_conflict_of_two_variables_is_refused_at_its_place(tmp_path: Path, declare: str, at: str) -> None:
    with pytest.raises(StructuredTextError, match=rf"program\.st:{at}: "):
        bound(tmp_path, declare)


def test_a_signal_that_a_variable_can_not_hold_stops_the_program(tmp_path: Path) -> None:
    plc = bound(tmp_path, "VAR {tag: zones/z/bottles} n : SINT; END_VAR")
    with pytest.raises(StructuredTextError, match=stating("zones/z/bottles", "200", "SINT", "-128 to 127")):
        scan(plc, 0, count=200)


TASKS = """CONFIGURATION c
  TASK slow (INTERVAL := T#30ms, PRIORITY := 1);
  PROGRAM main WITH slow : counts;
END_CONFIGURATION
PROGRAM counts VAR RETAIN n : INT; END_VAR VAR m : INT; t : TON; END_VAR
VAR_OUTPUT {tag: belts/a/cmd_speed} x : LREAL; END_VAR
n := n + 1; m := m + 1; t(IN := TRUE, PT := T#60ms); x := n;
END_PROGRAM
"""


def test_a_task_runs_at_its_interval_and_its_outputs_hold(tmp_path: Path) -> None:
    plc = bound(tmp_path, TASKS)
    assert [scan(plc, tick)["belts/a/cmd_speed"] for tick in range(7)] == [1, 1, 1, 2, 2, 2, 3]


def test_a_task_does_not_make_up_for_scans_that_there_were_not(tmp_path: Path) -> None:
    """A free-running node may be delayed. Its task continues at its interval, counted from the first scan."""
    plc = bound(tmp_path, TASKS)
    ticks = (0, 1, 2, 3, 100, 101, 102, 103, 104, 105)
    assert [scan(plc, tick)["belts/a/cmd_speed"] for tick in ticks] == [1, 1, 1, 2, 3, 3, 4, 4, 4, 5]


def test_an_interval_is_a_multiple_of_the_scan(tmp_path: Path) -> None:
    plc = bound(tmp_path, TASKS.replace("30ms", "25ms"))
    with pytest.raises(StructuredTextError, match=stating("program.st:2:8:", "25 ms", "multiple", "scan", "10 ms")):
        scan(plc, 0)


def test_a_snapshot_goes_on_as_the_program_would_have(tmp_path: Path) -> None:
    plc = bound(tmp_path, TASKS)
    for tick in range(5):
        scan(plc, tick)
    kept = json.loads(json.dumps(plc.snapshot()))
    other = bound(tmp_path, TASKS)
    other.restore(kept)
    for tick in range(5, 20):
        assert scan(plc, tick) == scan(other, tick)
    assert dict(plc.variables) == dict(other.variables)
    assert plc.variables["plc/main/t/q"] == 1.0


def test_a_snapshot_of_another_program_is_refused(tmp_path: Path) -> None:
    kept = bound(tmp_path, TASKS).snapshot()
    with pytest.raises(StructuredTextError, match=stating("snapshot", "another program")):
        bound(tmp_path, TASKS.replace("n + 1", "n + 2")).restore(kept)


def test_a_warm_restart_keeps_what_is_retained_and_a_cold_one_nothing(tmp_path: Path) -> None:
    plc = bound(tmp_path, TASKS)
    for tick in range(7):
        scan(plc, tick)
    plc.restart(warm=True)
    assert scan(plc, 7) == {"belts/a/cmd_speed": 4.0}
    assert plc.variables["plc/main/m"] == 1
    plc.restart()
    assert scan(plc, 8) == {"belts/a/cmd_speed": 1.0}


def test_a_warm_restart_keeps_what_blocks_retain_wherever_they_are(tmp_path: Path) -> None:
    (tmp_path / "p.st").write_text(
        """FUNCTION_BLOCK Counts VAR RETAIN n : INT; t : TON; END_VAR VAR m : INT; END_VAR
        n := n + 1; m := m + 1; t(IN := TRUE, PT := T#10s);
        END_FUNCTION_BLOCK
        TYPE Lane : STRUCT c : Counts; k : INT; END_STRUCT; END_TYPE
        VAR_GLOBAL RETAIN g : INT; END_VAR
        VAR_GLOBAL one : Counts; END_VAR
        PROGRAM main VAR a : ARRAY [1..2, 0..1] OF Counts; l : Lane; END_VAR
        g := g + 1; one(); a[2, 1](); l.c(); l.k := 5;
        END_PROGRAM"""
    )
    plc = StructuredText(tmp_path / "p.st")
    plc.bind(TAGS)
    for tick in range(3):
        scan(plc, tick)
    plc.restart(warm=True)
    kept = {name: value for name, value in plc.variables.items() if value}
    timer = {"in": 1.0, "pt": 10.0, "et": 0.02}
    assert kept == {
        "plc/g": 3.0,
        **{
            f"plc/{block}/{name}": value
            for block in ("one", "main/a[2,1]", "main/l/c")
            for name, value in (("n", 3.0), *((f"t/{name}", value) for name, value in timer.items()))
        },
    }


def test_a_variable_is_forced_and_let_go(tmp_path: Path) -> None:
    plc = bound(tmp_path, TASKS.replace("30ms", "10ms"))
    plc.force("plc/main/n", 100)
    assert [scan(plc, tick)["belts/a/cmd_speed"] for tick in range(3)] == [101, 101, 101]
    plc.unforce("plc/main/n")
    assert scan(plc, 3) == {"belts/a/cmd_speed": 101.0}
    with pytest.raises(StructuredTextError, match=stating("plc/main/k", "no such variable")):
        plc.force("plc/main/k", 1)


def test_a_trace_knows_the_statement_that_wrote_last(tmp_path: Path) -> None:
    body = "IF eye THEN\n  x := 1.0;\nELSE\n  x := 2.0;\nEND_IF;\nv[2] := 3;\nt(IN := eye, Q => q);"
    declare = (
        "VAR {tag: photo_eyes/e/blocked} eye : BOOL; {tag: belts/a/cmd_speed} x : LREAL; q : BOOL; y : INT; "
        "v : ARRAY [1..3] OF INT; t : TON; END_VAR"
    )
    plc = bound(tmp_path, declare, body, trace=True)
    scan(plc, 0)
    assert plc.last_written("plc/main/x").endswith("program.st:5:3")
    scan(plc, 1, eye=1)
    assert plc.last_written("plc/main/x").endswith("program.st:3:3")
    assert plc.last_written("plc/main/v[2]").endswith("program.st:7:1")
    assert plc.last_written("plc/main/q").endswith("program.st:8:1")
    assert plc.last_written("plc/main/y") == ""
    assert plc.last_written("plc/main/t/in") == plc.last_written("plc/main/t/et") == plc.last_written("plc/main/q")
    with pytest.raises(StructuredTextError, match="expected trace=True"):
        bound(tmp_path, declare, body).last_written("plc/main/x")


PASSED_ON = """TYPE P : STRUCT a, b : LREAL; END_STRUCT; END_TYPE
FUNCTION_BLOCK Sets VAR_IN_OUT o : LREAL; END_VAR VAR_INPUT v : LREAL; END_VAR
o := v;
END_FUNCTION_BLOCK
FUNCTION_BLOCK Outer VAR_IN_OUT p : P; w : ARRAY [1..2] OF LREAL; END_VAR VAR s : Sets; END_VAR
s(o := p.b, v := 2.0);
w[2] := p.b;
END_FUNCTION_BLOCK
FUNCTION gives : BOOL VAR_OUTPUT o : LREAL; END_VAR
o := 3.0;
END_FUNCTION
PROGRAM main VAR s : Sets; x : Outer; p : P; w : ARRAY [1..2] OF LREAL; b : BOOL; i : INT; END_VAR
VAR {tag: belts/a/cmd_speed} speed : LREAL; g, h : LREAL; END_VAR
speed := 0.0;
s(o := speed, v := 1.0);
x(p := p, w := w);
b := gives(o => g);
gives(h);
FOR i := 1 TO 3 DO ; END_FOR;
END_PROGRAM
"""


def test_a_trace_knows_who_wrote_what_was_passed_on(tmp_path: Path) -> None:
    (tmp_path / "p.st").write_text(PASSED_ON)
    plc = StructuredText(tmp_path / "p.st", trace=True)
    plc.bind(TAGS)
    assert scan(plc, 0) == {"belts/a/cmd_speed": 1.0}
    found = {
        name: plc.last_written(f"plc/main/{name}").rpartition("p.st:")[2]
        for name in ("speed", "p/b", "w[2]", "b", "g", "h", "i", "s/v", "x/s/v")
    }
    assert found == {
        "speed": "3:1",
        "p/b": "3:1",
        "w[2]": "7:1",
        "b": "17:1",
        "g": "17:6",
        "h": "18:1",
        "i": "19:1",
        "s/v": "15:1",
        "x/s/v": "6:1",
    }
    plain = StructuredText(tmp_path / "p.st")
    plain.bind(TAGS)
    scan(plain, 0)
    assert dict(plain.variables) == dict(plc.variables)


def test_two_of_one_program_share_nothing(tmp_path: Path) -> None:
    one, other = bound(tmp_path, TASKS), bound(tmp_path, TASKS)
    for tick in range(4):
        scan(one, tick)
    assert scan(other, 0) == {"belts/a/cmd_speed": 1.0}


def test_conditions_read_variables_and_the_picture_shows_them(tmp_path: Path) -> None:
    plant = Scenario(TABLE)
    plant.attach(together(StructuredText(PROGRAMS / "table.st")))
    plant.inject("machines/packer/stop")
    plant.eventually(lambda s: s["plc/table/held"], within=40)
    with pytest.raises(AssertionError, match="plc/table/free/et = 0") as caught:
        plant.eventually(lambda s: s["plc/table/free/et"] > 1.0, within=0.5)
    assert "plc/table/free/et" in str(caught.value)
    assert plant.history["plc/table/held"][-1] == 1.0
    assert traced(plant)[0] == "plc/table/free/et"
    assert draw_moment(plant, tmp_path / "line.png").stat().st_size > 0


def fill(plant: Scenario, program: Controller) -> None:
    plant.attach(program)
    plant.inject("machines/packer/stop")
    plant.eventually(lambda s: s["alarms/table full"], within=40)


def test_the_documented_line_and_its_fault(tmp_path: Path) -> None:
    """docs/testing_control_logic.md: the belt that should clear the eye is stopped by the eye."""
    faulty = tmp_path / "faulty.st"
    faulty.write_text((PROGRAMS / "table.st").read_text().replace("table_speed := 0.4", "table_speed := feeder_speed"))
    for program, goes_on in ((PROGRAMS / "table.st", True), (faulty, False)):
        plant = Scenario(TABLE)
        fill(plant, StructuredText(program))
        plant.always(lambda s: s["belts/table/bottles"] <= 45, for_=5)
        plant.inject("machines/packer/stop", 0)
        if goes_on:
            plant.eventually(lambda s: s["belts/feeder/speed"] > 0, within=15)
        else:
            with pytest.raises(AssertionError, match="did not come true"):
                plant.eventually(lambda s: s["belts/feeder/speed"] > 0, within=15)


def test_a_program_that_stops_says_where(tmp_path: Path) -> None:
    plc = bound(tmp_path, "VAR n : INT; END_VAR", "WHILE TRUE DO\n  n := n + 1;\nEND_WHILE")
    with pytest.raises(
        StructuredTextError, match=stating("program.st:2:1: watchdog", "more than", "1000000 statements")
    ):
        scan(plc, 0)


@pytest.mark.parametrize("number", ["9" * 5000, "T#" + "9" * 5000 + "s", "-" + "9" * 5000])
def test_a_number_that_goes_on_for_ever_is_refused(tmp_path: Path, number: str) -> None:
    with pytest.raises(StructuredTextError, match=r"program\.st:2:\d+: .*number of \d+ characters"):
        controller(tmp_path, "VAR n : LINT; END_VAR", f"n := {number};")


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (";" * 300_001, r":\d+:\d+: found more than 300000 words and signs, expected fewer"),
        ("n := n" + " + n" * 1000 + ";", r":2:4004: found 1001 operands in one expression, expected at most 1000"),
        ("n := " + "7" * 900 + ";", r":2:6: found 7{900}, expected a number of at most 64 bits"),
        ("n := 16#" + "7" * 90_000 + ";", r":2:6: found a number of 90003 characters, expected at most 1000"),
        (
            "IF n = 0 THEN ; " + "ELSIF n = 1 THEN ; " * 1000 + "END_IF",
            r":2:1: found 1001 branches of one IF, expected at most 1000",
        ),
        (
            "CASE n OF " + " ".join(f"{label}: ;" for label in range(3000)) + " END_CASE",
            r":2:1: found 3000 choices of one CASE, expected at most 1000",
        ),
        ("CASE n OF 1..9, 20: ; 12..15: ; 15: ; END_CASE", r":2:33: found 15, expected a label that no other choice"),
    ],
)
def test_a_program_that_is_too_large_is_refused_in_words(tmp_path: Path, body: str, said: str) -> None:
    with pytest.raises(StructuredTextError, match=said) as caught:
        controller(tmp_path, "VAR n : INT; END_VAR", body)
    assert len(str(caught.value)) < 3000


def chain(kind: str, count: int) -> str:
    """Return blocks that contain, or functions that call, each the one before it."""
    units = []
    for number in range(count):
        if kind == "blocks":
            inner, body = (f"F{number - 1}", "x();") if number else ("INT", ";")
            units.append(f"FUNCTION_BLOCK F{number} VAR x : {inner}; END_VAR {body} END_FUNCTION_BLOCK")
        else:
            called = f"f{number - 1}(a)" if number else "a"
            units.append(f"FUNCTION f{number} : INT VAR_INPUT a : INT; END_VAR f{number} := {called}; END_FUNCTION")
    use = f"x : F{count - 1};" if kind == "blocks" else "n : INT;"
    return (
        "\n".join(units)
        + f"\nPROGRAM main VAR {use} END_VAR\n"
        + ("x();" if kind == "blocks" else f"n := f{count - 1}(n);")
    )


def test_units_one_within_the_other_are_bounded(tmp_path: Path) -> None:
    path = tmp_path / "p.st"
    path.write_text(chain("blocks", 99) + "\nEND_PROGRAM")
    plc = StructuredText(path)
    plc.bind(TAGS)
    scan(plc, 0)
    plc.restore(json.loads(json.dumps(plc.snapshot())))
    path.write_text(chain("blocks", 2000) + "\nEND_PROGRAM")
    with pytest.raises(StructuredTextError, match=stating("p.st:101:16", "101 types", "at most")):
        StructuredText(path)
    path.write_text(chain("functions", 99) + "\nEND_PROGRAM")
    plc = StructuredText(path)
    plc.bind(TAGS)
    scan(plc, 0)
    for many in (101, 2000):
        path.write_text(chain("functions", many) + "\nEND_PROGRAM")
        with pytest.raises(StructuredTextError, match=r"p\.st:\d+:\d+: .*calls.* 100"):
            StructuredText(path)
    path.write_text("PROGRAM p ; END_PROGRAM " * 5001)
    with pytest.raises(
        StructuredTextError, match=stating("5001", "programs", "functions", "blocks", "at most", "5000")
    ):
        StructuredText(path)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ("PROGRAM p ; END_PROGRAM".encode("utf-16"), "is UTF-16"),
        (b"", ":1:1: found no PROGRAM, expected one or more"),
        (b"\0" * 1000, r":1:1: found '\\x00', expected Structured Text"),
        (b"PROGRAM p\rVAR n : INT; END_VAR\rn := m;\rEND_PROGRAM", "found m, which is not declared"),
    ],
)
def test_what_is_no_text_is_refused_in_words(tmp_path: Path, data: bytes, said: str) -> None:
    (tmp_path / "p.st").write_bytes(data)
    with pytest.raises(StructuredTextError, match=said):
        StructuredText(tmp_path / "p.st")


def test_what_is_no_file_is_said_to_be_none(tmp_path: Path) -> None:
    (tmp_path / "folder.st").mkdir()
    os.mkfifo(tmp_path / "pipe.st")
    with open(tmp_path / "large.st", "wb") as large:
        large.truncate(10**12)
    for name, fact in (("folder", "folder"), ("pipe", "named pipe"), ("large", "1000000 MB")):
        with pytest.raises(StructuredTextError, match=stating(f"{name}.st", fact, "program in Structured Text")):
            StructuredText(tmp_path / f"{name}.st")


def test_a_program_brought_over_from_codesys_runs_the_line() -> None:
    """docs/structured_text.md, A program carried through: unedited in its dialect, and with its changes in iec."""
    folder = PROGRAMS / "brought_over"
    with pytest.raises(StructuredTextError, match=stating("codesys.st:111:17", "GVL.xEyeHigh", "codesys")):
        StructuredText(folder / "codesys.st")
    unedited = load(str(folder / "codesys.st"), controller_parameters(str(folder / "codesys.yaml"), "--parameters"))
    hashes = []
    for program in (unedited, StructuredText(folder / "table.st")):
        plant = Scenario(TABLE)
        fill(plant, program)
        plant.always(lambda s: s["belts/table/bottles"] <= 45, for_=5)
        plant.inject("machines/packer/stop", 0)
        plant.eventually(lambda s: s["belts/feeder/speed"] > 0, within=15)
        assert plant.signals["plc/plc_prg/fbfeeder/nstops"] == 1
        assert plant.signals["plc/plc_prg/wstatus"] == 0x0102
        hashes.append(plant.simulation.state_hash())
    assert hashes[0] == hashes[1]
    assert any(not missing(sentence, "codesys.st:133:34", "DINT", "INT") for sentence in unedited.left_over)
