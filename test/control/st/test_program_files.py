# SPDX-License-Identifier: Apache-2.0
"""Programs in several files: of TIA Portal, of B&R Automation Studio, and in any order."""

from __future__ import annotations

from pathlib import Path

import pytest
from facts import missing, stating

from conveyor_sim.control.scan import ControlError
from conveyor_sim.control.st import program_files
from conveyor_sim.control.st.compile import compile_files
from conveyor_sim.control.st.controller import StructuredText
from conveyor_sim.control.st.errors import StructuredTextError
from conveyor_sim.control.st.load import load
from conveyor_sim.control.st.program import Program


def written(folder: Path, **texts: str) -> Path:
    """Write files into a folder; `__` in a name stands for a dot, `___` for a slash. Return the folder."""
    for name, text in texts.items():
        file = folder / name.replace("___", "/").replace("__", ".")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return folder


def values(program: Program, *names: str) -> list[float]:
    """Return the values of variables."""
    return [program.variables[name].number() for name in names]


def scanned(path: Path | list[Path], scans: int = 1, dialect: str = "") -> Program:
    """Return a program after some scans of 10 ms."""
    program = Program(compile_files(path, dialect=dialect))
    for tick in range(scans):
        program.run(tick * 10_000_000)
    return program


UNITS = {
    "main__st": "PROGRAM main VAR n : INT; b : Counting; END_VAR b(); n := Twice(b.n) + offset; END_PROGRAM",
    "counting__st": "FUNCTION_BLOCK Counting VAR_OUTPUT n : INT; END_VAR n := n + 1; END_FUNCTION_BLOCK",
    "twice__st": "FUNCTION Twice : INT VAR_INPUT x : INT; END_VAR Twice := 2 * x; END_FUNCTION",
    "globals__st": "VAR_GLOBAL CONSTANT offset : INT := 100; END_VAR",
}


def test_files_of_a_folder_are_one_program_in_any_order(tmp_path: Path) -> None:
    """The names and the order of the files change neither results nor the digest that snapshots carry."""
    folder = written(tmp_path / "a", **UNITS)
    other = written(tmp_path / "b", **{f"{'zyxw'[i]}___{name}": text for i, (name, text) in enumerate(UNITS.items())})
    files = sorted(folder.iterdir())
    programs = [scanned(paths, 3) for paths in (folder, other, files, files[::-1])]
    assert [values(program, "main/n") for program in programs] == [[106.0]] * 4
    assert len({program.compiled.digest for program in programs}) == 1


def test_errors_name_their_own_file_and_line(tmp_path: Path) -> None:
    folder = written(tmp_path, **UNITS)
    (folder / "twice.st").write_text("\n\nFUNCTION Twice : INT VAR_INPUT x : INT; END_VAR\n  Twice := y; END_FUNCTION")
    with pytest.raises(StructuredTextError, match=r"twice\.st:4:12: found y, which is not declared"):
        compile_files(folder)
    (folder / "main.st").write_text("PROGRAM main\nVAR n : INT; END_VAR\n n := 1 / (n + offset - 100); END_PROGRAM")
    (folder / "twice.st").write_text("FUNCTION Twice : INT ; END_FUNCTION")
    with pytest.raises(StructuredTextError, match=r"main\.st:3:2: .*division by zero"):
        scanned(folder)
    (folder / "counting.st").write_text("\nFUNCTION_BLOCK b x END_FUNCTION_BLOCK")
    with pytest.raises(StructuredTextError, match=r"counting\.st:2:20: "):
        compile_files(folder)


def test_a_folder_and_further_files_are_a_controller(tmp_path: Path) -> None:
    """The reference of a controller is a folder, or a file with the parameter `files`."""
    folder = written(tmp_path / "plc", **UNITS)
    rest = [str(folder / name) for name in ("twice.st", "counting.st", "globals.st")]
    for reference, parameters in ((folder, {}), (folder / "main.st", {"files": rest})):
        assert "plc/main/n" in load(str(reference), parameters).variables  # type: ignore[attr-defined]
    library = written(tmp_path / "library", **{name: text for name, text in UNITS.items() if name != "main__st"})
    assert StructuredText(folder / "main.st", files=library).variables["plc/main/n"] == 0
    with pytest.raises(ControlError, match="files"):
        load(str(folder / "main.st"), {"files": "twice.st"})
    with pytest.raises(ControlError, match="folder without a program"):
        load(str(written(tmp_path / "empty", readme__txt="")))


def test_a_folder_with_too_many_files_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = written(tmp_path, **UNITS)
    monkeypatch.setattr(program_files, "MOST_ENTRIES", 3)
    with pytest.raises(StructuredTextError, match="found more than 3 files"):
        compile_files(folder)
    monkeypatch.undo()
    monkeypatch.setattr(program_files, "MOST_FILES", 3)
    with pytest.raises(StructuredTextError, match="found 4 files, expected at most 3"):
        compile_files(folder)


@pytest.mark.parametrize("name", ["p.TcPOU", "p.xml", "p.awl", "p.project"])
def test_files_of_other_forms_are_refused_by_what_they_are(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("<xml/>")
    with pytest.raises(ControlError, match=r"found .*(XML|instruction list|project)"):
        load(str(tmp_path / name))


def test_a_text_of_an_older_tool_is_read(tmp_path: Path) -> None:
    """A byte above 127 that is no UTF-8 is one character."""
    (tmp_path / "p.exp").write_bytes("PROGRAM p VAR n : INT; END_VAR n := LEN('ü€'); END_PROGRAM".encode("cp1252"))
    assert values(scanned(tmp_path / "p.exp"), "p/n") == [2.0]


SCL = """TYPE "Lane data"
VERSION : 0.1
   STRUCT
      Count : Int;
      "Speed limit" : Real := 0.5;
   END_STRUCT;
END_TYPE

FUNCTION "Scale" : Real
TITLE = Scales 'a value
{ S7_Optimized_Access := 'TRUE' }
AUTHOR : somebody
VERSION : 0.1
   VAR_INPUT
      "In" : Real;
   END_VAR
BEGIN
   #Scale := #"In" * 2.0;
END_FUNCTION

FUNCTION_BLOCK "Counter"
{ S7_Optimized_Access := 'TRUE' }
VERSION : 0.1
   VAR_INPUT
      Step : Int := 1;
   END_VAR
   VAR
      Lane {ExternalWritable := 'false'} : "Lane data";
      Inner : Struct
         Twice : Int;
      END_STRUCT;
      Delay {InstructionName := 'TON_TIME'; LibVersion := '1.0'} : TON_TIME;
   END_VAR
BEGIN
   REGION Count "everything
      #Lane.Count := #Lane.Count + #Step; // a step
      #Inner.Twice := 2 * #Lane.Count;
   END_REGION
   #Delay(IN := TRUE, PT := T#20ms);
END_FUNCTION_BLOCK

DATA_BLOCK "Counter_DB"
{ S7_Optimized_Access := 'TRUE' }
VERSION : 0.1
NON_RETAIN
"Counter"
BEGIN
   Step := 5;
END_DATA_BLOCK

DATA_BLOCK "Settings"
VERSION : 0.1
   STRUCT
      Limit : Int := 3;
      Deep : Struct
         Value : Int := 4;
         Other : Int := 6;
      END_STRUCT;
   END_STRUCT;
BEGIN
   Deep.Value := 7;
END_DATA_BLOCK

ORGANIZATION_BLOCK "Main"
VERSION : 0.1
   VAR_TEMP
      x : Real;
   END_VAR
BEGIN
   "Counter_DB"();
   #x := "Scale"("In" := "Counter_DB".Lane."Speed limit");
   (/* de-DE: Summe */)
   "Settings".Limit := "Settings".Deep.Value + "Settings".Deep.Other;
END_ORGANIZATION_BLOCK
"""


def test_a_source_of_tia_portal_runs(tmp_path: Path) -> None:
    """Quotation marks, #, VERSION, REGION, BEGIN, data blocks and TON_TIME."""
    file = written(tmp_path, main__scl=SCL) / "main.scl"
    program = scanned(file, 3)
    names = ("counter_db/lane/count", "counter_db/inner/twice", "counter_db/delay/q", "settings/limit")
    assert values(program, *names) == [15.0, 30.0, 1.0, 13.0]


def test_an_iec_timer_is_called_by_the_name_of_an_instruction(tmp_path: Path) -> None:
    text = (
        "DATA_BLOCK \"t\"\n{InstructionName := 'IEC_TIMER'}\nVERSION : 1.0\nIEC_TIMER\nBEGIN\nEND_DATA_BLOCK\n"
        'ORGANIZATION_BLOCK "Main" VAR late, held : IEC_TIMER; END_VAR BEGIN "t".TP(IN := TRUE, PT := T#15ms);\n'
        "#late.TON(IN := TRUE, PT := T#20ms); #held.TOF(IN := FALSE, PT := T#20ms); END_ORGANIZATION_BLOCK"
    )
    folder = written(tmp_path, main__scl=text)
    q = ("t/q", "main/late/q", "main/held/q")
    assert [values(scanned(folder, n), *q) for n in (2, 3)] == [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    written(tmp_path, main__scl=text.replace('"t".TP(', '"t"('))
    with pytest.raises(StructuredTextError, match=stating("IEC_TIMER", ".TON", ".TOF", ".TP", ".TONR")):
        compile_files(folder)


def test_an_iec_counter_is_called_by_the_name_of_an_instruction(tmp_path: Path) -> None:
    """Single instance, multi-instances of several types, limits of the type, and Q of each instruction."""
    text = (
        "DATA_BLOCK \"c\"\n{InstructionName := 'IEC_COUNTER'}\nVERSION : 1.0\nIEC_COUNTER\nBEGIN\nEND_DATA_BLOCK\n"
        'FUNCTION_BLOCK "Counting" VAR tick : Bool; up, down : Bool; n : UInt; small : IEC_SCOUNTER; '
        "both : IEC_UDCOUNTER; local : CTU_USINT; END_VAR BEGIN #tick := NOT #tick;\n"
        '"c".CTU(CU := #tick, R := FALSE, PV := 2, Q => #up);\n'
        "#small.CTD(CD := #tick, LD := FALSE, PV := 3, Q => #down);\n"
        "#both.CTUD(CU := #tick, CD := FALSE, R := FALSE, LD := FALSE, PV := 100000);\n"
        "#local(CU := #tick, R := FALSE, PV := 255, CV => #n); END_FUNCTION_BLOCK\n"
        'DATA_BLOCK "f" "Counting" BEGIN END_DATA_BLOCK ORGANIZATION_BLOCK "Main" BEGIN "f"(); END_ORGANIZATION_BLOCK'
    )
    folder = written(tmp_path, main__scl=text)
    names = ("c/cv", "c/qu", "f/up", "f/small/cv", "f/small/qd", "f/down", "f/both/cv", "f/both/qu", "f/n")
    assert values(scanned(folder, 2), *names) == [1, 0, 0, -1, 1, 1, 1, 0, 1]
    assert values(scanned(folder, 3), *names) == [2, 1, 1, -2, 1, 1, 2, 0, 2]
    assert values(scanned(folder, 600), *names) == [300, 1, 1, -128, 1, 1, 300, 0, 255]


def test_tonr_adds_up_the_time_until_its_reset(tmp_path: Path) -> None:
    text = (
        'FUNCTION_BLOCK "Adding" VAR n : Int; t : IEC_TIMER; own : TONR_TIME; END_VAR BEGIN #n := #n + 1;\n'
        "#t.TONR(IN := #n MOD 3 <> 0, R := #n = 9, PT := T#25ms);\n"
        "#own(IN := #n MOD 3 <> 0, R := FALSE, PT := T#15ms); END_FUNCTION_BLOCK\n"
        'DATA_BLOCK "a" "Adding" BEGIN END_DATA_BLOCK ORGANIZATION_BLOCK "Main" BEGIN "a"(); END_ORGANIZATION_BLOCK'
    )
    folder = written(tmp_path, main__scl=text)
    elapsed = {scans: values(scanned(folder, scans), "a/t/et", "a/t/q", "a/own/q") for scans in (2, 3, 5, 7, 8, 9, 10)}
    assert elapsed == {
        2: [pytest.approx(0.01), 0, 0],
        3: [pytest.approx(0.01), 0, 0],
        5: [pytest.approx(0.02), 0, 1],
        7: [pytest.approx(0.02), 0, 1],
        8: [pytest.approx(0.025), 1, 1],
        9: [0, 0, 1],
        10: [0, 0, 1],
    }


@pytest.mark.parametrize(
    ("call", "facts"),
    [
        ('"c"(CU := TRUE)', ("IEC_COUNTER", ".CTU", ".CTD", ".CTUD")),
        ('"c".CTU(LD := TRUE)', ("LD", "CTU_INT", "CU", "R", "PV", "Q", "CV")),
        ('"c".CTD(CV := 1)', ("CV", "CTD_INT", "=>")),
        ('"c".TON(IN := TRUE)', ("IEC_COUNTER.TON", ".CTU", ".CTD", ".CTUD")),
        ('"c".CTU(CU := TRUE, PV := 40000)', ("40000", "INT", "32767")),
    ],
)
def test_a_wrong_call_of_an_iec_counter_is_refused_at_its_place(
    tmp_path: Path, call: str, facts: tuple[str, ...]
) -> None:
    text = f'DATA_BLOCK "c"\nIEC_COUNTER\nBEGIN\nEND_DATA_BLOCK\nORGANIZATION_BLOCK "Main"\nBEGIN\n{call};\n'
    with pytest.raises(StructuredTextError, match=r"main\.scl:7:\d+: ") as caught:
        compile_files(written(tmp_path, main__scl=f"{text}END_ORGANIZATION_BLOCK"))
    assert missing(str(caught.value), facts) == []


def test_positions_in_a_source_of_tia_portal_are_those_of_the_text(tmp_path: Path) -> None:
    text = SCL.replace("#Lane.Count + #Step;", "#Lane.Count + #Stop;")
    line = next(n for n, one in enumerate(text.splitlines(), 1) if "#Stop" in one)
    column = text.splitlines()[line - 1].index("#Stop") + 2
    with pytest.raises(StructuredTextError, match=rf":{line}:{column}: found Stop, which is not declared"):
        compile_files(written(tmp_path, main__scl=text))


@pytest.mark.parametrize("name", ["OB100", "Startup", "OB35"])
def test_blocks_that_do_not_run_cyclically_need_a_task(tmp_path: Path, name: str) -> None:
    text = f'ORGANIZATION_BLOCK "{name}"\nBEGIN\nEND_ORGANIZATION_BLOCK\n'
    with pytest.raises(StructuredTextError, match=rf"{name}, which is not cyclic"):
        compile_files(written(tmp_path, main__scl=text))
    task = f"CONFIGURATION c TASK t (INTERVAL := T#20ms, PRIORITY := 1); PROGRAM o WITH t : {name}; END_CONFIGURATION"
    assert compile_files(written(tmp_path, tasks__st=task)).programs[0].interval == 20_000_000


BR = {
    "Global__var": "VAR\n gCount : Counting := (step := 2);\nEND_VAR\nVAR CONSTANT\n LIMIT_2 : INT := 6;\nEND_VAR",
    "Global__typ": "TYPE\n Counting : STRUCT (*of all*)\n  step : INT := 1;\n  n : INT;\n END_STRUCT;\nEND_TYPE",
    "Feed___Main__st": (
        "PROGRAM _INIT\n starts := starts + 1;\nEND_PROGRAM\nPROGRAM _CYCLIC\n local(n := gCount.n);\n"
        " IF gCount.n >= LIMIT_2 THEN RETURN; END_IF;\n gCount.n := local.sum;\nEND_PROGRAM\n"
        "PROGRAM _EXIT\n starts := 0;\nEND_PROGRAM"
    ),
    "Feed___Types__typ": "\nTYPE\n\nEND_TYPE\n",
    "Feed___Variables__var": "VAR\n starts : INT;\n local : Adding;\nEND_VAR",
    "Lib___Lib__fun": (
        "{REDUND_OK} FUNCTION_BLOCK Adding VAR_INPUT n : {REDUND_UNREPLICABLE} INT; END_VAR "
        "VAR_OUTPUT sum : INT; END_VAR END_FUNCTION_BLOCK"
    ),
    "Lib___Adding__st": "FUNCTION_BLOCK Adding\n sum := n + gCount.step;\nEND_FUNCTION_BLOCK",
}


def test_a_project_of_automation_studio_runs(tmp_path: Path) -> None:
    """Variables of .var are local to the program of their folder, or global. _INIT runs once, _EXIT never."""
    program = scanned(written(tmp_path, **BR), 5)
    assert values(program, "feed/starts", "gcount/n") == [1.0, 6.0]
    assert {"feed/local/sum", "limit_2"} <= set(program.variables)


def test_a_library_of_automation_studio_without_source_is_missing(tmp_path: Path) -> None:
    """A declaration in a .fun file without a body is no block that does nothing."""
    folder = written(tmp_path, **BR)
    (folder / "Lib" / "Adding.st").unlink()
    with pytest.raises(StructuredTextError, match=r"Variables\.var:3:10: found Adding, expected a type"):
        compile_files(folder)


def test_what_a_project_of_automation_studio_can_not_have(tmp_path: Path) -> None:
    folder = written(tmp_path, **BR)
    written(folder, Feed___Second__st="PROGRAM _CYCLIC\n ;\nEND_PROGRAM")
    with pytest.raises(StructuredTextError, match=r"found PROGRAM _CYCLIC again in Feed"):
        compile_files(folder)
    (folder / "Feed" / "Second.st").unlink()
    written(folder, Feed___Main__st="PROGRAM _INIT\n IF TRUE THEN RETURN; END_IF;\nEND_PROGRAM")
    with pytest.raises(StructuredTextError, match=r"Main\.st:2:15: found RETURN in PROGRAM _INIT"):
        compile_files(folder)


def test_a_unit_as_codesys_shows_it_needs_no_end(tmp_path: Path) -> None:
    """Declaration and body without END_FUNCTION_BLOCK, each in a file, and FUNCTIONBLOCK as CODESYS 2.3 has it."""
    main = "PROGRAM main VAR f : Adding; n : INT; END_VAR f(); f(); n := f.n;"
    folder = written(tmp_path, main__st=main, f__st="FUNCTIONBLOCK Adding VAR_OUTPUT n : INT; END_VAR n := n + 1;")
    assert values(scanned(folder, dialect="codesys"), "main/n") == [2.0]
    with pytest.raises(StructuredTextError, match="FUNCTIONBLOCK"):
        compile_files(folder)
    written(folder, f__st="FUNCTION_BLOCK Adding VAR_OUTPUT n : INT; END_VAR IF TRUE THEN n := n + 1;")
    with pytest.raises(StructuredTextError, match="END_IF"):
        compile_files(folder, dialect="codesys")


def test_type_may_be_the_name_of_a_field_in_codesys(tmp_path: Path) -> None:
    text = "TYPE t : STRUCT Type : INT; END_STRUCT END_TYPE; PROGRAM p VAR x : t; END_VAR x.Type := 1; END_PROGRAM"
    folder = written(tmp_path, p__st=text)
    assert values(scanned(folder, dialect="codesys"), "p/x/type") == [1.0]
    with pytest.raises(StructuredTextError, match=r":1:17: found 'Type'"):
        compile_files(folder)


def test_a_program_calls_another_in_codesys(tmp_path: Path) -> None:
    """The called program runs once in each scan, where it is called; its variables are those of its name."""
    main = "PROGRAM main VAR n : INT; END_VAR Outputs(); n := Outputs.sum; END_PROGRAM"
    outputs = "PROGRAM Outputs VAR sum : INT; END_VAR sum := sum + 1; END_PROGRAM"
    folder = written(tmp_path, main__st=main, outputs__st=outputs)
    program = scanned(folder, 3, "codesys")
    assert values(program, "main/n", "outputs/sum") == [3.0, 3.0]
    assert [one.name for one in program.compiled.programs] == ["main"]
    with pytest.raises(StructuredTextError, match="Outputs"):
        compile_files(folder)
    written(folder, outputs__st="PROGRAM Outputs VAR sum : INT; END_VAR main(); END_PROGRAM")
    with pytest.raises(StructuredTextError, match=r"no recursion|no PROGRAM"):
        compile_files(folder, dialect="codesys")


def test_files_of_two_vendors_need_a_dialect(tmp_path: Path) -> None:
    folder = written(
        tmp_path, a__exp="FUNCTION f : INT f := 1; END_FUNCTION", b__scl="FUNCTION g : Int g := 1; END_FUNCTION"
    )
    written(folder, c__st="PROGRAM p ; END_PROGRAM")
    with pytest.raises(StructuredTextError, match=r"found files of codesys and tia"):
        compile_files(folder)
    assert [one.name for one in compile_files(folder, dialect="tia").programs] == ["p"]
