# SPDX-License-Identifier: Apache-2.0
"""Variables that share memory, as a controller sees them: tags, forces, traces, restarts and snapshots."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from facts import missing, stating

from conveyor_sim.control.scan import Inputs, LineTags
from conveyor_sim.control.st.controller import StructuredText
from conveyor_sim.control.st.errors import StructuredTextError
from conveyor_sim.protocols.modbus.address_map import modbus_map
from conveyor_sim.support.modbus_rows import to_csv
from conveyor_sim.testing import Scenario

TAGS = LineTags(
    signals={"eye": "bool", "other_eye": "bool"}, commands={"run": "bool", "turn": "bool", "speed": "number"}
)
TABLE = Path(__file__).parent.parent.parent / "testing" / "table.yaml"

SHARED = """VAR_GLOBAL w AT %MW0 : WORD; END_VAR
PROGRAM main
VAR RETAIN n AT %MB0 : USINT; END_VAR
VAR b AT %MX1.0 : BOOL; m : USINT; END_VAR
n := n + 1; m := n;
IF n = 3 THEN
  b := TRUE;
END_IF
END_PROGRAM
"""


def loaded(folder: Path, text: str, **options: object) -> StructuredText:
    path = folder / "program.st"
    path.write_text(text)
    return StructuredText(path, **options)  # type: ignore[arg-type]


def bound(folder: Path, text: str, **options: object) -> StructuredText:
    plc = loaded(folder, text, **options)
    plc.bind(TAGS)
    return plc


def program(declare: str, body: str = ";") -> str:
    return f"PROGRAM main {declare}\n{body}\nEND_PROGRAM\n"


def scan(plc: StructuredText, tick: int, **signals: float) -> dict[str, float]:
    return dict(plc.scan(Inputs(dict.fromkeys(TAGS.signals, 0.0) | signals, tick * 0.01, tick, 0.01)))


def test_a_snapshot_holds_the_memory(tmp_path: Path) -> None:
    plc, other = bound(tmp_path, SHARED), bound(tmp_path, SHARED)
    for tick in range(4):
        scan(plc, tick)
    other.restore(json.loads(json.dumps(plc.snapshot())))
    assert dict(other.variables) == dict(plc.variables)
    assert other.variables["plc/w"] == 0x104
    for running in (plc, other):
        scan(running, 4)
    assert dict(other.variables) == dict(plc.variables)
    assert other.variables["plc/w"] == 0x105


def test_a_snapshot_without_the_memory_is_refused(tmp_path: Path) -> None:
    """Earlier versions made such snapshots."""
    plc = bound(tmp_path, SHARED)
    kept = plc.snapshot()
    del kept["globals"]["located"]
    with pytest.raises(StructuredTextError, match=stating("snapshot", "without", "shared memory")):
        plc.restore(kept)


def test_a_snapshot_with_other_numbers_than_bytes_is_refused(tmp_path: Path) -> None:
    plc = bound(tmp_path, SHARED)
    kept = plc.snapshot()
    for values, said in (([0, 256], "expected bytes"), ([0, -1], "expected bytes"), ([0], "expected 2 values")):
        kept["globals"]["located"]["values"] = values
        with pytest.raises(StructuredTextError, match=said):
            plc.restore(kept)


def test_two_controllers_share_nothing(tmp_path: Path) -> None:
    one, other = bound(tmp_path, SHARED), bound(tmp_path, SHARED)
    scan(one, 0)
    assert (one.variables["plc/w"], other.variables["plc/w"]) == (1, 0)


def test_a_warm_restart_keeps_the_bytes_that_are_retained(tmp_path: Path) -> None:
    plc = bound(tmp_path, SHARED)
    for tick in range(3):
        scan(plc, tick)
    assert plc.variables["plc/w"] == 0x103
    plc.restart(warm=True)
    assert plc.variables["plc/w"] == 3
    plc.restart()
    assert plc.variables["plc/w"] == 0


def test_a_force_holds_the_memory(tmp_path: Path) -> None:
    plc = bound(tmp_path, SHARED)
    plc.force("plc/main/n", 40)
    scan(plc, 0)
    assert (plc.variables["plc/w"], plc.variables["plc/main/m"]) == (40, 41)


def test_a_trace_knows_who_wrote_the_memory(tmp_path: Path) -> None:
    plc = bound(tmp_path, SHARED, trace=True)
    scan(plc, 0)
    for name in ("w", "main/n", "main/b"):
        assert plc.last_written(f"plc/{name}").endswith("program.st:5:1")
    scan(plc, 1)
    scan(plc, 2)
    assert plc.last_written("plc/w").endswith("program.st:7:3")


def test_a_tag_is_that_of_all_who_share_its_place(tmp_path: Path) -> None:
    declare = (
        "VAR {tag: eye} a AT %IX0.0 : BOOL; b AT %IX0.0 : BOOL; {tag: run} c AT %QX0.0 : BOOL; d AT %QX0.0 : BOOL; "
        "e AT %QX0.1 : BOOL; END_VAR"
    )
    plc = bound(tmp_path, program(declare, "d := b;"))
    assert scan(plc, 0, eye=1)["run"] == 1.0
    assert scan(plc, 1, eye=0)["run"] == 0.0
    assert plc.left_over[0].endswith("no tag for main/e")


def test_a_place_of_the_map_may_have_several_names(tmp_path: Path) -> None:
    plant = Scenario(TABLE)
    rows = modbus_map(plant.simulation.process_image.tags)
    (tmp_path / "map.csv").write_text(to_csv(rows))
    where = {row.name: row for row in rows}
    speed = where["belts/table/cmd_speed"].address
    plc = loaded(
        tmp_path,
        program(f"VAR a AT %QD{speed} : REAL; b AT %QD{speed} : REAL; END_VAR", "b := 0.25;"),
        modbus_map=tmp_path / "map.csv",
    )
    plant.attach(plc)
    plant.run_for(0.05)
    assert plant.history["belts/table/cmd_speed"][-1] == 0.25
    assert plant.signals["plc/main/a"] == 0.25


@pytest.mark.parametrize(
    ("declare", "said"),
    [
        (
            "VAR {tag: eye} a AT %MX0.0 : BOOL; {tag: other_eye} b AT %MX0.0 : BOOL; END_VAR",
            "found other_eye for main/b, and eye for main/a, expected one tag, because they share memory",
        ),
        (
            "VAR {tag: run} a AT %QX0.0 : BOOL; {tag: turn} b AT %QX0.0 : BOOL; END_VAR",
            "found turn for main/b, and run for main/a, expected one tag",
        ),
        (
            "VAR a AT %QX0.0 : BOOL; b AT %QW0 : WORD; END_VAR",
            "found main/a at %QX0.0, main/b at %QW0, expected a tag for each or other addresses",
        ),
        (
            "VAR a AT %QD1 : DINT; {tag: run} b AT %QX6.1 : BOOL; END_VAR",
            "found main/a at %QD1, main/b at %QX6.1, expected a tag for each or other addresses",
        ),
    ],
)
def test_tags_that_can_not_be_are_refused_before_the_first_scan(tmp_path: Path, declare: str, said: str) -> None:
    with pytest.raises(StructuredTextError) as caught:
        bound(tmp_path, program(declare))
    assert said in str(caught.value)


@pytest.mark.parametrize(
    "declare",
    [
        "VAR {tag: run} a AT %QX0.0 : BOOL; {tag: speed} b AT %QW0 : LREAL; END_VAR",  # as in OpenPLC
        "VAR a AT %QX2.0 : BOOL; b AT %QW0 : WORD; c AT %QD1 : DINT; d AT %IW0 : INT; END_VAR",
        "VAR a AT %QX2.0 : BOOL; a_too AT %QX16 : BOOL; END_VAR",
    ],
)
def test_places_that_are_apart_or_have_tags_are_taken(tmp_path: Path, declare: str) -> None:
    assert bound(tmp_path, program(declare)).mapping is not None


PLANT = """FUNCTION_BLOCK Gate
VAR eye AT %I* : BOOL; go AT %Q* : BOOL; END_VAR
go := NOT eye;
END_FUNCTION_BLOCK
TYPE Station : STRUCT gate : Gate; END_STRUCT; END_TYPE
VAR_GLOBAL speed AT %Q* : LREAL; END_VAR
PROGRAM main
VAR one : Gate; more : ARRAY [0..1] OF Station; bits AT %I* : ARRAY [1..2] OF BOOL; END_VAR
one(); more[1].gate(); speed := 1.5;
IF bits[2] THEN speed := 2.5; END_IF
END_PROGRAM
"""
MAP = {
    "main/one/eye": "eye",
    "MAIN/One/Go": "run",
    "main/more[1]/gate/eye": "other_eye",
    "main/more[1]/gate/go": "turn",
    "main/bits[2]": "other_eye",
}


def test_each_instance_has_its_own_inputs_and_outputs(tmp_path: Path) -> None:
    plc = bound(tmp_path, PLANT, tags=MAP)
    assert scan(plc, 0, eye=1.0) == {"run": 0.0, "turn": 1.0, "speed": 1.5}
    assert scan(plc, 1, other_eye=1.0) == {"run": 1.0, "turn": 0.0, "speed": 2.5}


def test_the_mapping_lists_what_has_no_tag(tmp_path: Path) -> None:
    plc = bound(tmp_path, PLANT, tags=MAP)
    assert plc.mapping is not None
    assert plc.mapping.variables == ("main/more[0]/gate/eye", "main/more[0]/gate/go", "main/bits[1]")
    assert not missing(str(plc.mapping), "main/one/eye <- eye (by tag)", "speed -> speed (by name)")


@pytest.mark.parametrize(
    ("tags", "words"),
    [
        ({"main/one/eye": "run"}, ("eye", "run", "a signal")),
        ({"main/one/go": "eye"}, ("go", "eye", "a command")),
        ({"main/one/go": "speed"}, ("BOOL", "speed", "REAL or LREAL")),
        ({"main/more[2]/gate/go": "run"}, ("main/more[2]/gate/go", "expected one of", "main/one/eye")),
        ({"main/one/go": "run", "main/more[0]/gate/go": "run"}, ("run", "main/one/go and main/more[0]/gate/go")),
        ({"main/one": "run"}, ("Gate", "run")),
    ],
)
def test_wrong_maps_are_refused(tmp_path: Path, tags: dict[str, str], words: tuple[str, ...]) -> None:
    with pytest.raises(StructuredTextError, match=stating(*words)):
        bound(tmp_path, PLANT, tags=tags)


def test_a_snapshot_holds_them(tmp_path: Path) -> None:
    plc, other = bound(tmp_path, PLANT, tags=MAP), bound(tmp_path, PLANT, tags=MAP)
    scan(plc, 0, eye=1.0)
    other.restore(plc.snapshot())
    assert other.variables["plc/main/one/eye"] == plc.variables["plc/main/one/eye"] == 1.0


def test_too_many_variables_without_a_number_are_refused(tmp_path: Path) -> None:
    block = "FUNCTION_BLOCK B VAR a AT %I* : ARRAY [1..100] OF BOOL; END_VAR ; END_FUNCTION_BLOCK\n"
    bound(tmp_path, block + program("VAR b : ARRAY [1..100] OF B; END_VAR"))
    with pytest.raises(StructuredTextError, match=stating("program.st:1:22", "10000", "%I*")):
        bound(tmp_path, block + program("VAR b : ARRAY [1..101] OF B; END_VAR"))
